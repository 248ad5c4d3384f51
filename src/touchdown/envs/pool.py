"""Worlds side by side, each reset and stepped when its time comes: stock's or the engine's."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from touchdown.core import threads
from touchdown.core.types import FloatArray, IntArray, StepResult
from touchdown.envs import environment
from touchdown.envs.environment import Env
from touchdown.lander import rules
from touchdown.lander.engine import Engine

# to share fewer takes longer than it saves
_WORLDS_A_THREAD = 32


class EnvPool(Protocol):
    """Worlds by number, from 0."""

    def reset(self, index: int, seed: int) -> FloatArray:
        """Start an episode; gives its first observation, [D]."""
        ...

    def step(self, indices: IntArray, actions: IntArray) -> StepResult:
        """One step of some of the worlds, in the order of `slots`, which rises."""
        ...

    def close(self) -> None:
        """Give the worlds back."""
        ...


def make_pool(env_id: str, count: int, engine: Engine) -> EnvPool:
    """So many worlds; the exact engine's if it is asked for and flies that world.

    Raises:
        UserError: there is no such world, or it cannot be made.
    """
    if engine == "exact" and rules.is_lander(env_id):
        return _ExactEnvPool(count)
    return StockEnvPool([environment.make_env(env_id).env for _ in range(count)])


class StockEnvPool:
    """Gymnasium's environments, each on its own.

    Args:
        envs: one for each slot.
    """

    def __init__(self, envs: Sequence[Env]) -> None:
        self._envs = envs

    def reset(self, index: int, seed: int) -> FloatArray:
        """Start an episode; gives its first observation, [D]."""
        return self._envs[index].reset(seed=seed)[0]

    def step(self, indices: IntArray, actions: IntArray) -> StepResult:
        """One step of some of them, in the order of `slots`."""
        stepped = [
            self._envs[index].step(action)[:4]
            for index, action in zip(_listed(indices), _listed(actions), strict=True)
        ]
        observations, rewards, terminated, truncated = zip(*stepped, strict=True)
        return StepResult(
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


class _ExactEnvPool:
    def __init__(self, count: int) -> None:
        # where the engine was not built there is nothing to import
        from touchdown.lander._engine import Batch  # noqa: PLC0415

        num_threads = min(threads.threads(), -(-count // _WORLDS_A_THREAD))
        self._batch = Batch(count, num_threads=num_threads)
        self._actions = np.zeros(count, np.int64)
        self._observations = np.zeros((count, rules.OBSERVATION_SIZE), np.float32)
        self._rewards = np.zeros(count)
        self._terminated = np.zeros(count, np.bool_)
        self._tasks = np.zeros(count, np.uint8)
        self._steps = np.zeros(count, np.int64)

    def reset(self, index: int, seed: int) -> FloatArray:
        self._batch.seed(index, seed)
        self._advance(np.array([index]), rules.BEGIN)
        self._steps[index] = 0
        return self._observations[index].copy()

    def step(self, indices: IntArray, actions: IntArray) -> StepResult:
        self._actions[indices] = actions
        self._advance(indices, rules.STEP)
        self._steps[indices] += 1
        return StepResult(
            self._observations[indices],
            self._rewards[indices],
            self._terminated[indices],
            self._steps[indices] >= rules.MAX_EPISODE_STEPS,
        )

    def _advance(self, indices: IntArray, task: int) -> None:
        self._tasks[:] = rules.NOTHING
        self._tasks[indices] = task
        self._batch.step(
            self._actions, self._observations, self._rewards, self._terminated, self._tasks
        )

    def close(self) -> None:
        """The engine holds nothing but memory."""
