"""Worlds side by side, each reset and stepped when its time comes: stock's or the engine's."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from touchdown import cores
from touchdown.lander import env as lander
from touchdown.lander.env import Engine, Env
from touchdown.types import FloatArray, IntArray, Steps

# to share fewer takes longer than it saves
_WORLDS_A_THREAD = 32


class Slots(Protocol):
    """Worlds by number, from 0."""

    def reset(self, slot: int, seed: int) -> FloatArray:
        """Start an episode; gives its first observation, [D]."""
        ...

    def step(self, slots: IntArray, actions: IntArray) -> Steps:
        """One step of some of the worlds, in the order of `slots`, which rises."""
        ...

    def close(self) -> None:
        """Give the worlds back."""
        ...


def make_slots(env_id: str, count: int, engine: Engine) -> Slots:
    """So many worlds; the exact engine's if it is asked for and flies that world.

    Raises:
        UserError: there is no such world, or it cannot be made.
    """
    if engine == "exact" and lander.is_lander(env_id):
        return _ExactSlots(count)
    return StockSlots([lander.make(env_id).env for _ in range(count)])


class StockSlots:
    """Gymnasium's environments, each on its own.

    Args:
        envs: one for each slot.
    """

    def __init__(self, envs: Sequence[Env]) -> None:
        self._envs = envs

    def reset(self, slot: int, seed: int) -> FloatArray:
        """Start an episode; gives its first observation, [D]."""
        return self._envs[slot].reset(seed=seed)[0]

    def step(self, slots: IntArray, actions: IntArray) -> Steps:
        """One step of some of them, in the order of `slots`."""
        stepped = [
            self._envs[slot].step(action)[:4]
            for slot, action in zip(_listed(slots), _listed(actions), strict=True)
        ]
        observations, rewards, terminated, truncated = zip(*stepped, strict=True)
        return Steps(
            np.stack(observations),
            np.array(rewards, float),
            np.array(terminated, bool),
            np.array(truncated, bool),
        )

    def close(self) -> None:
        """Close them all."""
        for env in self._envs:
            env.close()


def _listed(numbers: IntArray) -> list[int]:
    return numbers.tolist()


class _ExactSlots:
    def __init__(self, count: int) -> None:
        # where the engine was not built there is nothing to import
        from touchdown.lander.engine import Batch  # noqa: PLC0415

        threads = min(cores.threads(), -(-count // _WORLDS_A_THREAD))
        self._batch = Batch(count, num_threads=threads)
        self._actions = np.zeros(count, np.int64)
        self._observations = np.zeros((count, lander.OBSERVATION_SIZE), np.float32)
        self._rewards = np.zeros(count)
        self._terminated = np.zeros(count, np.bool_)
        self._tasks = np.zeros(count, np.uint8)
        self._steps = np.zeros(count, np.int64)

    def reset(self, slot: int, seed: int) -> FloatArray:
        self._batch.seed(slot, seed)
        self._advance(np.array([slot]), lander.BEGIN)
        self._steps[slot] = 0
        return self._observations[slot].copy()

    def step(self, slots: IntArray, actions: IntArray) -> Steps:
        self._actions[slots] = actions
        self._advance(slots, lander.STEP)
        self._steps[slots] += 1
        return Steps(
            self._observations[slots],
            self._rewards[slots],
            self._terminated[slots],
            self._steps[slots] >= lander.MAX_EPISODE_STEPS,
        )

    def _advance(self, slots: IntArray, task: int) -> None:
        self._tasks[:] = lander.NOTHING
        self._tasks[slots] = task
        self._batch.step(
            self._actions, self._observations, self._rewards, self._terminated, self._tasks
        )

    def close(self) -> None:
        """The engine holds nothing but memory."""
