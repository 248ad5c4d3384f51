"""The complete state of a training run on disk: safetensors and JSON, validated, never pickled."""

import hashlib
import os
import shutil
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.config.checks import is_plain_name
from touchdown.core import files, limits, reading, records
from touchdown.core.errors import UnreadableError, UserError, one_line
from touchdown.core.seeding import Streams
from touchdown.core.types import Tensors
from touchdown.envs.episodes import Episode
from touchdown.training.loggers import Saved
from touchdown.training.state import (
    FORMAT_VERSION,
    READABLE,
    CandidateState,
    CheckpointState,
    GeneratorState,
    Solved,
)

_STATE, _STATE_SUM = "state.json", "state.sha256"
_SET_ASIDE = "damaged-"
_KEPT = 2  # so that another is there if the newest is damaged
_OWN_GROUPS = ("finalists", "underway")  # in addition to the agent's


class DamagedError(UserError):
    """A checkpoint, or a record that it names, is not as it was written.

    What the system does not let be read is another error: it may be whole.
    """


@dataclass(frozen=True, slots=True)
class Candidate:
    """Weights of a candidate checkpoint."""

    env_steps: int
    validation_return: float
    weights: Tensors


@dataclass(slots=True)
class Progress:
    """The progress of a run, without the state of its agent."""

    episodes: int = 0
    env_steps: int = 0
    next_validation: int = 0
    seconds: float = 0.0
    trained: bool = False
    """Training is over; only the selection among the candidates remains."""
    finished: bool = False
    solved: Solved | None = None
    """The evidence that the environment is solved, if training stopped for that reason."""
    underway: list[Episode] = field(default_factory=list[Episode])
    """After a restore: the unfinished episode of each environment. Environments are deterministic,
    so repeating the actions leads to the same state."""
    candidates: list[Candidate] = field(default_factory=list[Candidate])
    records: Saved = field(default_factory=Saved)
    """How much of each record belongs to this progress."""


def save_checkpoint(
    folder: Path,
    digest: str,
    agent: Agent,
    streams: Streams,
    progress: Progress,
    episodes: Sequence[Episode],
) -> Path:
    """Write the next checkpoint, `folder/<number>/`, atomically, and keep only the previous one.

    Raises:
        OSError: it cannot be written; the previous checkpoint is kept.
        TypeError: the agent's state has a name or a value that a checkpoint cannot hold.
    """
    of_agent, facts = _parts(agent.state())
    tensors = {
        **of_agent,
        "finalists": _candidate_tensors(progress.candidates),
        "underway": _underway_tensors(episodes),
    }
    newest = newest_checkpoint(folder)
    path = folder / f"{int(newest.name) + 1 if newest else 0:08d}"

    def write(temporary: Path) -> None:
        digests: dict[str, str] = {}
        for name, group in tensors.items():
            data = files.to_safetensors(group)
            digests[name] = hashlib.sha256(data).hexdigest()
            (temporary / f"{name}.safetensors").write_bytes(data)
        state = CheckpointState(
            config_digest=digest,
            episodes=progress.episodes,
            env_steps=progress.env_steps,
            agent=facts,
            next_validation=progress.next_validation,
            seconds=progress.seconds,
            trained=progress.trained,
            finished=progress.finished,
            solved=progress.solved,
            underway=[episode.number for episode in episodes],
            candidates=[
                CandidateState(env_steps=each.env_steps, validation_return=each.validation_return)
                for each in progress.candidates
            ],
            streams={
                name: GeneratorState.of(generator) for name, generator in streams._asdict().items()
            },
            record_sizes=progress.records.sizes,
            record_sha256=progress.records.sha256,
            sha256=digests,
        )
        data = files.to_json(state).encode()
        (temporary / _STATE).write_bytes(data)
        # in the format of the program sha256sum
        line = f"{hashlib.sha256(data).hexdigest()}  {_STATE}\n"
        (temporary / _STATE_SUM).write_text(line, "utf-8")

    files.write_folder_atomic(path, write)
    for older in sorted(_checkpoints(folder))[:-_KEPT]:
        shutil.rmtree(older)
    return path


def newest_checkpoint(folder: Path) -> Path | None:
    """The checkpoint that was written last, or None.

    Raises:
        UnreadableError: the folder cannot be read.
    """
    return max(_checkpoints(folder), default=None)


def restore_newest(folder: Path, digest: str, agent: Agent, streams: Streams) -> Progress | None:
    """Restore the newest checkpoint that is whole into a fresh agent and its random streams.

    Args:
        folder: the folder of a run's checkpoints, which is in the folder of its records.
        digest: digest of the run's config.
        agent: a fresh agent.
        streams: the run's random streams.

    Returns:
        The run's progress; None if there are no checkpoints.

    Raises:
        DamagedError: there are checkpoints, but none is whole.
        UserError: the checkpoint is from another config or version, or cannot be read.
    """
    damage: DamagedError | None = None
    for path in sorted(_checkpoints(folder), reverse=True):
        try:
            return restore_checkpoint(path, digest, agent, streams)
        except DamagedError as error:
            damage = damage or error
    if damage is not None:
        raise damage
    return None


def set_aside_checkpoints(folder: Path) -> None:
    """Rename all checkpoints of a run, so that its training starts again and nothing is lost.

    Raises:
        OSError: one cannot be renamed.
    """
    for path in _checkpoints(folder):
        aside, number = path.with_name(_SET_ASIDE + path.name), 1
        while os.path.lexists(aside):
            number += 1
            aside = path.with_name(f"{_SET_ASIDE}{path.name}-{number}")
        path.rename(aside)
    files.sync(folder)


def restore_checkpoint(path: Path, digest: str, agent: Agent, streams: Streams) -> Progress:
    """Restore a checkpoint into a fresh agent and its random streams.

    Raises:
        DamagedError: the checkpoint is truncated or altered, or the records that it names are;
            the agent and the streams are as before.
        UserError: the checkpoint is from another config or version, or cannot be read.
    """
    with _as_damage():
        data, confirmed = _read_state(path)
    records.check_version(data, READABLE, path / _STATE)
    with _as_damage():
        state = records.decode(data, CheckpointState, path / _STATE)
        if state.format_version == FORMAT_VERSION and not confirmed:
            raise UserError(f"{path / _STATE_SUM}: missing")
    if state.config_digest != digest:
        raise UserError(
            f"{path}: config_digest = {state.config_digest!r}: must be {digest!r}, as in this run"
        )
    with _as_damage():
        groups = {
            name: files.read_tensors(path / f"{name}.safetensors", sha256)[0]
            for name, sha256 in state.sha256.items()
        }
        saved = Saved(state.record_sizes, state.record_sha256)
        saved.check(path.parent.parent)
    try:
        agent.restore({**state.agent, **groups})
        for name, generator in streams._asdict().items():
            state.streams[name].restore(generator)
        return Progress(
            episodes=state.episodes,
            env_steps=state.env_steps,
            next_validation=state.next_validation,
            seconds=state.seconds,
            trained=state.trained,
            finished=state.finished,
            solved=state.solved,
            underway=_underway_from(state.underway, groups["underway"]),
            candidates=_candidates_from(state.candidates, groups["finalists"]),
            records=saved,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: not a checkpoint of this run: {one_line(error)}") from None


@contextmanager
def _as_damage() -> Generator[None]:
    try:
        yield
    except UnreadableError:  # it may be whole, and readable later
        raise
    except UserError as error:
        raise DamagedError(str(error)) from None


def _read_state(path: Path) -> tuple[bytes, bool]:
    """The bytes of `state.json`, and whether a recorded SHA-256 confirms them.

    Raises:
        UserError: they cannot be read, or have another SHA-256.
    """
    state, recorded = path / _STATE, path / _STATE_SUM
    data = reading.read_bytes(state, limits.RECORD_BYTES, follow=False)
    known = None
    if os.path.lexists(recorded):
        known = reading.read_bytes(recorded, limits.KIB, follow=False).split()
    wanted = [hashlib.sha256(data).hexdigest().encode(), _STATE.encode()]
    if known is not None and known != wanted:
        raise UserError(f"{state}: altered since it was written (its SHA-256 differs)")
    return data, known is not None


def _parts(state: Mapping[str, Any]) -> tuple[dict[str, Tensors], dict[str, Any]]:
    """An agent's state as groups of arrays and plain values."""
    groups: dict[str, Tensors] = {}
    facts: dict[str, Any] = {}
    for name, value in state.items():
        if name in _OWN_GROUPS or not is_plain_name(name):
            raise TypeError(f"agent.state(): {name!r} cannot be the name of a part of it")
        if isinstance(value, dict):
            # safetensors writes an array's memory as it lies
            groups[name] = {
                each: np.asarray(array, order="C") for each, array in cast(Tensors, value).items()
            }
        else:
            facts[name] = value
    return groups, facts


def _candidate_tensors(candidates: Sequence[Candidate]) -> Tensors:
    return {
        f"{each.env_steps}/{name}": array
        for each in candidates
        for name, array in each.weights.items()
    }


def _underway_tensors(episodes: Sequence[Episode]) -> Tensors:
    tensors: Tensors = {}
    for index, episode in enumerate(episodes):
        tensors[f"{index}.actions"] = np.array(episode.actions, np.int32)
        tensors[f"{index}.observation"] = np.array(episode.observation, np.float32)
    return tensors


def _underway_from(numbers: Sequence[int], tensors: Tensors) -> list[Episode]:
    if len(tensors) != 2 * len(numbers):
        raise ValueError(
            f"{len(numbers)} unfinished episodes, but their file has {len(tensors) // 2}"
        )
    return [
        Episode(number, tensors[f"{index}.observation"], tensors[f"{index}.actions"].tolist())
        for index, number in enumerate(numbers)
    ]


def _candidates_from(states: Sequence[CandidateState], tensors: Tensors) -> list[Candidate]:
    weights: dict[str, Tensors] = {}
    for name, array in tensors.items():
        env_steps, _, of_weights = name.partition("/")
        weights.setdefault(env_steps, {})[of_weights] = array
    if len(weights) != len(states):
        raise ValueError(f"{len(states)} candidate checkpoints, but their file has {len(weights)}")
    return [
        Candidate(each.env_steps, each.validation_return, weights[str(each.env_steps)])
        for each in states
    ]


def _checkpoints(folder: Path) -> list[Path]:
    """The folders of checkpoints in a folder.

    Raises:
        UnreadableError: it cannot be read, so that there may be some; or a link takes the place of
            one, and leads to folders that are not the run's.
    """
    if folder.is_symlink():
        raise UnreadableError(f"{folder}: is a symbolic link, must be a folder")
    try:
        with os.scandir(folder) as entries:
            found = [entry for entry in entries if entry.name.isascii() and entry.name.isdecimal()]
            for entry in found:
                if entry.is_symlink():
                    raise UnreadableError(f"{entry.path}: is a symbolic link, must be a folder")
            return [folder / entry.name for entry in found if entry.is_dir()]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise UnreadableError(f"{folder}: cannot be read: {one_line(error)}") from None
