import pytest

from touchdown.cli import parse
from touchdown.cli.former_flags import FORMER_FLAGS, with_present_names
from touchdown.cli.train import Train
from touchdown.cli.tune import TuneAgent


@pytest.mark.parametrize("given", [["--max-observations=70"], ["--max_observations", "70"]])
def test_former_flags_of_train_still_set_their_fields(given):
    verb = parse.parse(["train", "dqn", *given, "--finalists=3"])
    assert isinstance(verb, Train)
    assert verb.training.max_env_steps == 70
    assert verb.training.candidate_checkpoints == 3


def test_the_former_flag_of_tune_agent_still_sets_the_length_of_a_training():
    verb = parse.parse(["tune", "agent", "pilot", "--observations", "60000"])
    assert isinstance(verb, TuneAgent)
    assert verb.env_steps == 60_000


def test_a_former_flag_is_renamed_for_its_own_verb_alone():
    assert with_present_names(["evaluate", "pid", "--finalists=3"]) == [
        "evaluate",
        "pid",
        "--finalists=3",
    ]


def test_what_a_flag_is_set_to_is_never_renamed():
    words = ["train", "--name=--finalists=3", "--config=--finalists"]
    assert with_present_names(words) == words


@pytest.mark.parametrize("verb", FORMER_FLAGS)
def test_every_present_name_is_in_the_help_and_no_former_one(verb, capsys):
    with pytest.raises(SystemExit):
        parse.parse([*verb, *(["pilot"] if verb == ("train",) else []), "--help"])
    words = set(capsys.readouterr().out.split())
    assert words >= set(FORMER_FLAGS[verb].values())
    assert not words & set(FORMER_FLAGS[verb])
