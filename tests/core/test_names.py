import pytest

from touchdown.core.errors import UserError
from touchdown.core.names import check_misspelt, hint, nearest


@pytest.mark.parametrize(
    ("given", "found"),
    [("gama", "gamma"), ("GAMMA", "gamma"), ("max-steps", "max_steps"), ("xyz", None)],
)
def test_the_nearest_name_is_none_where_all_are_far(given, found):
    assert nearest(given, ["alpha", "gamma", "max_steps"]) == found


def test_a_name_of_a_million_letters_is_near_to_none():
    assert nearest("a" * 1_000_000, ["a" * 999_999]) is None


def test_a_hint_lists_few_names_and_suggests_one_of_many():
    assert hint("adma", ["adam", "sgd"]) == "must be one of adam, sgd; did you mean adam?"
    assert hint(3, ["adam", "sgd"]) == "must be one of adam, sgd"
    many = [f"name{number}" for number in range(20)]
    assert hint("nam3", many) == "did you mean name3?"
    assert hint("zzz", many, "`touchdown presets` lists them") == "`touchdown presets` lists them"


def test_a_missing_file_is_refused_with_the_one_that_was_probably_meant(tmp_path):
    (tmp_path / "checkpoints").mkdir()
    for name in ("mine.toml", "flights.safetensors", "checkpoints/best.safetensors"):
        (tmp_path / name).touch()
    for given, meant in (
        ("mein.toml", "mine.toml"),
        ("best.safetensors", "checkpoints/best.safetensors"),
        ("flight.safetensors", "flights.safetensors"),
    ):
        with pytest.raises(UserError, match=f"{given}: no such file; did you mean .*/{meant}\\?$"):
            check_misspelt(tmp_path / given)
    for other in ("mine.toml", "mine.zip", "x.toml", "no/mine.toml", "nul\0.toml"):
        check_misspelt(tmp_path / other)  # there, or to be refused by what reads it
