import errno
import os
import shutil
from hashlib import sha256

import numpy as np
import pytest

from checkpoints import read_state, write_state
from single_changes import is_refused_in_a_line, single_changes
from touchdown.agents.registry import make_agent
from touchdown.config.presets import preset
from touchdown.core import reading
from touchdown.core.errors import UnreadableError, UserError
from touchdown.core.seeding import streams
from touchdown.envs import environment
from touchdown.envs.episodes import Episode
from touchdown.training.checkpoint import (
    Candidate,
    DamagedError,
    Progress,
    restore_checkpoint,
    restore_newest,
    save_checkpoint,
    set_aside_checkpoints,
)
from touchdown.training.loggers import Saved
from touchdown.training.state import GeneratorState, Solved

CONFIG = preset("tabular-q")
RECORDS = ("episodes.jsonl", "updates.jsonl", "validations.jsonl")
LINE = b'{"a": 1}\n'
SAVED = Saved(dict.fromkeys(RECORDS, 9), dict.fromkeys(RECORDS, sha256(LINE).hexdigest()))


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
        records=SAVED,
    )
    for name in RECORDS:
        (tmp_path / name).write_bytes(LINE + b"after the checkpoint")
    (tmp_path / "checkpoints").mkdir()
    episodes = [Episode(4, np.zeros(16, np.float32), [1, 2])]
    where = tmp_path / "checkpoints"
    return save_checkpoint(where, CONFIG.digest, agent, generators, progress, episodes)


def restored(path):
    return restore_checkpoint(path, CONFIG.digest, *fresh())


def newest(path):
    return restore_newest(path.parent, CONFIG.digest, *fresh())


def rewrite(path, **changes):
    write_state(path, read_state(path) | changes)


def test_what_is_saved_comes_back(saved):
    progress = restored(saved)
    assert (progress.episodes, progress.seconds, progress.solved) == (4, 1.5, Solved(1.0, 0.7, 30))
    assert [(f.env_steps, f.validation_return) for f in progress.candidates] == [(100, 0.5)]
    assert (progress.underway[0].number, progress.underway[0].actions) == (4, [1, 2])
    assert progress.records == SAVED


def test_one_wrong_value_in_the_state_is_reported_in_one_line(saved):
    refused = 0
    for other in single_changes(read_state(saved)):
        write_state(saved, other)
        refused += is_refused_in_a_line(lambda: restored(saved), str(saved.parent.parent))
    assert refused > 300


def test_a_state_with_any_byte_changed_is_refused(saved):
    data = (saved / "state.json").read_bytes()
    for at in (0, len(data) // 2, len(data) - 1):
        (saved / "state.json").write_bytes(data[:at] + b"0" + data[at + 1 :])
        with pytest.raises(DamagedError, match=r"state\.json: altered since it was written"):
            restored(saved)
    (saved / "state.json").write_bytes(data)
    (saved / "state.sha256").unlink()
    with pytest.raises(DamagedError, match=r"state\.sha256: missing"):
        restored(saved)


def test_a_state_of_the_former_format_is_read(saved):
    former = read_state(saved) | {"format_version": 3}
    del former["record_sha256"]
    write_state(saved, former)
    (saved / "state.sha256").unlink()
    assert restored(saved).records == Saved(SAVED.sizes)


@pytest.mark.parametrize("name", RECORDS)
def test_a_record_that_is_not_what_its_checkpoint_names_is_refused(saved, name):
    path = saved.parent.parent / name
    for data, said in (
        (LINE[:-1], "shorter than its checkpoint says"),
        (LINE.replace(b"1", b"2"), "altered since its checkpoint"),
        (b"\0" * 9, "altered since its checkpoint"),  # after a power loss
    ):
        path.write_bytes(data)
        with pytest.raises(DamagedError, match=f"{name}: .*{said}"):
            restored(saved)


def test_the_newest_checkpoint_that_is_whole_is_taken(saved):
    for number in (1, 2):
        newer = shutil.copytree(saved, saved.with_name(f"{number:08d}"))
        write_state(newer, read_state(newer) | {"episodes": 10 + number})
    assert newest(saved).episodes == 12
    (newer / "finalists.safetensors").write_bytes(b"")
    assert newest(saved).episodes == 11
    (saved.parent.parent / "episodes.jsonl").write_bytes(b"")
    with pytest.raises(DamagedError, match="00000002/finalists"):
        newest(saved)
    for _ in range(2):
        shutil.copytree(saved.parent, where := saved.parent.with_name("again"), dirs_exist_ok=True)
        set_aside_checkpoints(saved.parent)
        assert newest(saved) is None
        shutil.copytree(where / saved.name, saved)
    names = [f"damaged-0000000{number}" for number in (0, 1, 2)]
    found = sorted(path.name for path in saved.parent.iterdir())
    assert found == [saved.name, names[0], f"{names[0]}-2", *names[1:]]


@pytest.mark.parametrize("name", ["state.json", "state.sha256", "learner.safetensors", *RECORDS])
def test_what_cannot_be_read_for_now_is_not_damage(saved, name, monkeypatch):
    opened = os.open

    def refuse(path, *rest):
        if str(path).endswith(name):
            raise OSError(errno.EMFILE, "Too many open files")
        return opened(path, *rest)

    monkeypatch.setattr(reading.os, "open", refuse)
    with pytest.raises(UnreadableError, match=f"{name}: cannot be read: Too many open files"):
        newest(saved)


def test_a_folder_of_checkpoints_that_cannot_be_read_is_not_taken_for_empty(saved, monkeypatch):
    def refuse(_):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "scandir", refuse)
    with pytest.raises(UnreadableError, match="checkpoints: cannot be read: Permission denied"):
        newest(saved)


@pytest.mark.parametrize("name", ["state.json", "state.sha256"])
def test_a_pipe_in_a_checkpoint_is_refused_and_does_not_block(saved, name):
    (saved / name).unlink()
    os.mkfifo(saved / name)
    with pytest.raises(UnreadableError, match=f"{name}: is a named pipe"):
        newest(saved)


def test_links_to_folders_that_are_not_the_runs_are_refused(saved, tmp_path):
    (tmp_path / "photos" / "2023").mkdir(parents=True)
    (saved.parent / "00000007").symlink_to(tmp_path / "photos" / "2023")
    with pytest.raises(UnreadableError, match="00000007: is a symbolic link"):
        newest(saved)
    saved.parent.rename(tmp_path / "before")
    (tmp_path / "checkpoints").symlink_to(tmp_path / "photos")
    with pytest.raises(UnreadableError, match="checkpoints: is a symbolic link"):
        newest(saved)
    assert (tmp_path / "photos" / "2023").is_dir()


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
        ({"format_version": 1}, "format_version = 1: must be 3 or 4 in this version"),
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
    state = read_state(saved)
    state["streams"]["replay"]["state"][name] = value
    write_state(saved, state)
    with pytest.raises(UserError, match=rf"state\.json: streams\.replay\.state\.{said}"):
        restored(saved)
