import pytest

from touchdown.core.names import hint, nearest


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
