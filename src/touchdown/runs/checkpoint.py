"""A training run's whole state on disk: safetensors and JSON, checked when read, never pickled."""

import hashlib
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import jax
import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import save

from touchdown import files
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learner import LearnerState
from touchdown.errors import UserError, one_line
from touchdown.files import Tensors
from touchdown.seeding import Streams

FORMAT_VERSION = 1


@dataclass(frozen=True, slots=True)
class Finalist:
    """Weights that did well on the validation starts."""

    observations: int
    validation_return: float
    params: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Midway:
    """An episode under way."""

    actions: tuple[int, ...]
    """Taken since its start: the world is deterministic, and comes to the same place by them."""
    observation: NDArray[np.float32]
    """The latest, [D], to see that it did."""
    epsilon: float
    next_q: NDArray[np.float32] | None
    """Q(s,·) of the latest observation, [A], if the agent has it already."""


@dataclass(slots=True)
class Progress:
    """Where a run stands, beside what the agent knows."""

    episodes: int = 0
    next_validation: int = 0
    seconds: float = 0.0
    finished: bool = False
    midway: Midway | None = None
    """None at the end of an episode."""
    finalists: list[Finalist] = field(default_factory=list[Finalist])
    record_sizes: dict[str, int] = field(default_factory=dict[str, int])


def save_checkpoint(
    folder: Path, digest: str, agent: DQNAgent, streams: Streams, progress: Progress
) -> Path:
    """Write the next checkpoint, `folder/<number>/`, in one rename, then remove the older ones.

    Raises:
        OSError: it cannot be written; the checkpoint before stays.
    """
    tensors = {
        "learner": _learner_tensors(agent.state),
        "memory": agent.memory.tensors(),
        "finalists": {str(f.observations): f.params for f in progress.finalists},
    }
    midway = progress.midway
    if midway is not None:
        tensors["midway"] = {
            "actions": np.array(midway.actions, np.int32),
            "observation": midway.observation,
            **({} if midway.next_q is None else {"next_q": midway.next_q}),
        }
    newest = newest_checkpoint(folder)
    path = folder / f"{int(newest.name) + 1 if newest else 0:08d}"

    def write(temporary: Path) -> None:
        digests: dict[str, str] = {}
        for name, group in tensors.items():
            data = save(group)
            digests[name] = hashlib.sha256(data).hexdigest()
            (temporary / f"{name}.safetensors").write_bytes(data)
        state = {
            "format_version": FORMAT_VERSION,
            "config_digest": digest,
            "episodes": progress.episodes,
            "observations": agent.observations,
            "updates": agent.updates,
            "next_validation": progress.next_validation,
            "seconds": progress.seconds,
            "finished": progress.finished,
            "midway": midway and {"epsilon": midway.epsilon},
            "memory_added": agent.memory.ring.added,
            "finalists": [
                {"observations": f.observations, "validation_return": f.validation_return}
                for f in progress.finalists
            ],
            "streams": {
                name: generator.bit_generator.state for name, generator in streams._asdict().items()
            },
            "record_sizes": progress.record_sizes,
            "sha256": digests,
        }
        (temporary / "state.json").write_text(files.to_json(state), "utf-8")

    files.write_folder_atomic(path, write)
    for older in _checkpoints(folder):
        if older != path:
            shutil.rmtree(older)
    return path


def newest_checkpoint(folder: Path) -> Path | None:
    """The checkpoint that a run goes on from, or None where there is none."""
    return max(_checkpoints(folder), default=None)


def restore_checkpoint(path: Path, digest: str, agent: DQNAgent, streams: Streams) -> Progress:
    """Put a checkpoint into a fresh agent and its streams.

    Raises:
        UserError: the checkpoint is cut off, altered, of another config or another version.
    """
    state = files.read_json(path / "state.json")
    if state.get("format_version") != FORMAT_VERSION:
        raise UserError(
            f"{path}: format_version = {state.get('format_version')!r}: "
            f"this touchdown reads {FORMAT_VERSION}"
        )
    if state.get("config_digest") != digest:
        raise UserError(
            f"{path}: belongs to config {state.get('config_digest')!r}, this run's is {digest!r}"
        )
    try:
        groups = {
            name: files.read_tensors(path / f"{name}.safetensors", state["sha256"][name])[0]
            for name in ("learner", "memory", "finalists", "midway")
            if name != "midway" or state.get("midway") is not None
        }
        agent.state = _learner_from(agent.state, groups["learner"])
        agent.memory.restore(groups["memory"], state["memory_added"])
        agent.observations = state["observations"]
        agent.updates = state["updates"]
        for name, generator in streams._asdict().items():
            generator.bit_generator.state = state["streams"][name]
        finalists = [
            Finalist(
                f["observations"],
                f["validation_return"],
                groups["finalists"][str(f["observations"])],
            )
            for f in state["finalists"]
        ]
        return Progress(
            episodes=state["episodes"],
            next_validation=state["next_validation"],
            seconds=state["seconds"],
            finished=state["finished"],
            midway=_midway(state["midway"], groups["midway"]) if "midway" in groups else None,
            finalists=finalists,
            record_sizes=dict(state["record_sizes"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: not a checkpoint of this run: {one_line(error)}") from None


def _midway(facts: Mapping[str, Any], tensors: Tensors) -> Midway:
    actions = tuple(tensors["actions"].tolist())
    epsilon = float(facts["epsilon"])
    return Midway(actions, tensors["observation"], epsilon, tensors.get("next_q"))


def _learner_tensors(state: LearnerState) -> Tensors:
    return {name: np.array(leaf) for name, leaf in _named_leaves(state).items()}


def _learner_from(like: LearnerState, tensors: Mapping[str, NDArray[Any]]) -> LearnerState:
    named = _named_leaves(like)
    if named.keys() != tensors.keys():
        raise ValueError(f"it holds {sorted(tensors)}, the learner needs {sorted(named)}")
    leaves: list[jax.Array] = []
    for name, leaf in named.items():
        value = tensors[name]
        if value.shape != leaf.shape or value.dtype != leaf.dtype:
            raise ValueError(
                f"{name} is {value.dtype}{value.shape}, must be {leaf.dtype}{leaf.shape}"
            )
        leaves.append(jax.numpy.array(value))
    return cast(LearnerState, jax.tree.unflatten(cast(Any, jax.tree.structure(like)), leaves))


def _named_leaves(state: LearnerState) -> dict[str, jax.Array]:
    leaves = cast(list[tuple[Any, jax.Array]], jax.tree.leaves_with_path(state))
    return {jax.tree_util.keystr(path).lstrip("."): leaf for path, leaf in leaves}


def _checkpoints(folder: Path) -> list[Path]:
    return [path for path in folder.glob("[0-9]*") if path.is_dir() and path.name.isdecimal()]
