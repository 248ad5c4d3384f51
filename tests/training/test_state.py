import json

import numpy as np
import pytest

from single_changes import is_refused_in_a_line, single_changes
from touchdown.agents.registry import make_agent
from touchdown.config.presets import preset
from touchdown.core.errors import UserError
from touchdown.core.seeding import streams
from touchdown.envs import environment
from touchdown.envs.episodes import Episode
from touchdown.training.checkpoint import (
    Candidate,
    Progress,
    restore_checkpoint,
    save_checkpoint,
)
from touchdown.training.state import GeneratorState, Solved

CONFIG = preset("tabular-q")
SIZES = {"episodes.jsonl": 9, "updates.jsonl": 9, "validations.jsonl": 9}


def fresh():
    generators = streams(0)
    return make_agent(CONFIG, environment.spaces_of(CONFIG.env_id), generators), generators


@pytest.fixture
def saved(tmp_path):
    agent, generators = fresh()
    generators.replay.random(3)
    progress = Progress(
        episodes=4,
        next_validation=2_000,
        seconds=1.5,
        candidates=[Candidate(100, 0.5, agent.weights())],
        solved=Solved(1.0, 0.7, 30),
        record_sizes=SIZES,
    )
    episodes = [Episode(4, np.zeros(16, np.float32), [1, 2])]
    return save_checkpoint(tmp_path, CONFIG.digest, agent, generators, progress, episodes)


def restored(path):
    return restore_checkpoint(path, CONFIG.digest, *fresh())


def rewrite(path, **changes):
    state = json.loads((path / "state.json").read_text())
    (path / "state.json").write_text(json.dumps(state | changes))


def test_what_is_saved_comes_back(saved):
    progress = restored(saved)
    assert (progress.episodes, progress.seconds, progress.solved) == (4, 1.5, Solved(1.0, 0.7, 30))
    assert [(f.env_steps, f.validation_return) for f in progress.candidates] == [(100, 0.5)]
    assert (progress.underway[0].number, progress.underway[0].actions) == (4, [1, 2])
    assert progress.record_sizes == SIZES


def test_one_wrong_value_in_the_state_is_reported_in_one_line(saved):
    record = json.loads((saved / "state.json").read_text())
    refused = 0
    for other in single_changes(record):
        (saved / "state.json").write_text(json.dumps(other))
        refused += is_refused_in_a_line(lambda: restored(saved), str(saved))
    assert refused > 300


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"trained": 1}, "trained = 1: must be true or false"),
        (
            {"trained": True, "finalists": []},
            r"finalists = \[\]: must have at least 1 with trained",
        ),
        ({"finalists": []}, "0 candidate checkpoints, but their file has 1"),
        ({"finished": True}, "finished = True: must be False with trained = False"),
        ({"underway": []}, r"underway = \[\]: must have at least 1 with trained = False"),
        ({"underway": [1, 2]}, "2 unfinished episodes, but their file has 1"),
        ({"record_sizes": []}, r"record_sizes = \[\]: must be an object"),
        ({"record_sizes": {"episodes.jsonl": 9}}, r"record_sizes: updates\.jsonl: missing"),
        ({"streams": {}}, "not a checkpoint of this run: 'exploration'"),
        ({"agent": {"observations": 1, "updates": 1}}, "not a checkpoint of this run: 'pending'"),
        ({"config_digest": "another"}, "config_digest = 'another': must be"),
        ({"format_version": 1}, "format_version = 1: must be 3 in this version"),
    ],
)
def test_a_state_that_contradicts_itself_is_refused(saved, changes, said):
    rewrite(saved, **changes)
    with pytest.raises(UserError, match=said) as refused:
        restored(saved)
    assert "\n" not in str(refused.value)


def test_a_generator_goes_on_from_its_state():
    one, other = streams(0).replay, streams(1).replay
    one.integers(0, 9, dtype=np.int32)  # half of a draw of 64 bits is left over
    GeneratorState.of(one).restore(other)
    assert one.random(5).tolist() == other.random(5).tolist()


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("inc", -1, "inc = -1: must be an odd number"),
        ("inc", 2, "inc = 2: must be an odd number"),
        ("state", 2**128, r"state = \d+: must be from 0 to 2\*\*128 - 1"),
    ],
)
def test_a_generators_state_that_no_generator_has_is_refused(saved, name, value, said):
    state = json.loads((saved / "state.json").read_text())
    state["streams"]["replay"]["state"][name] = value
    (saved / "state.json").write_text(json.dumps(state))
    with pytest.raises(UserError, match=rf"state\.json: streams\.replay\.state\.{said}"):
        restored(saved)
