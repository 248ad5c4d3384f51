import pytest

from touchdown.cli.flags import flags_of
from touchdown.cli.policies import Evaluate
from touchdown.cli.runs import Compare
from touchdown.cli.words import ordered
from touchdown.core.errors import UserError


def words(kind: type, *given: str) -> list[str]:
    return ordered("verb", flags_of(kind), given, {"--old": "--episodes"}, {"--bins": "train"})


def test_words_without_a_flag_come_first_and_underscores_become_dashes():
    assert words(Evaluate, "--runs_dir", "a_b", "pid") == ["pid", "--runs-dir", "a_b"]
    assert words(Compare, "a", "--out", "x", "b") == ["a", "b", "--out", "x"]


def test_a_negative_number_is_a_value_and_no_flag():
    assert words(Evaluate, "pid", "--seed", "-1") == ["pid", "--seed", "-1"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["pid", "--olds", "1"], "--olds: unknown option; did you mean --episodes?"),
        (["pid", "--bins"], "--bins: unknown option; it is an option of `touchdown train`;"),
        (["pid", "-q"], "-q: unknown option; `touchdown verb --help` lists them"),
        (["pid", "--json", "--no-json"], "--json: given 2 times; must be given once"),
        (["--seed", "1"], "verb: needs POLICY; `touchdown verb --help` describes it"),
    ],
)
def test_a_word_that_the_verb_does_not_take_is_refused(given, said):
    with pytest.raises(UserError) as refused:
        words(Evaluate, *given)
    assert str(refused.value).startswith(said)
