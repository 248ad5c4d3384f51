"""Environments stepped together and reset individually, from Gymnasium or the exact engine."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from touchdown.core import threads
from touchdown.core.types import FloatArray, IntArray, Spaces, StepResult
from touchdown.envs.environment import MadeEnv, make_env, spaces_of
from touchdown.lander import rules
from touchdown.lander.engine import Engine

# with fewer, starting a thread takes longer than it saves
_ENVS_PER_THREAD = 64


class EnvPool(Protocol):
    """N environments, numbered from 0."""

    @property
    def spaces(self) -> Spaces:
        """What an agent needs to know about the environment."""
        ...

    def reset(self, index: int, seed: int) -> FloatArray:
        """Start an episode in one environment; return its first observation, [D]."""
        ...

    def step(self, indices: IntArray, actions: IntArray) -> StepResult:
        """Step some of the environments.

        Args:
            indices: indices of the environments, in increasing order.
            actions: one action for each, in the same order.
        """
        ...

    def close(self) -> None:
        """Close the environments."""
        ...


def make_pool(env_id: str, num_envs: int, engine: Engine) -> EnvPool:
    """A pool of environments with one id.

    Args:
        env_id: Gymnasium id.
        num_envs: N, at least 1.
        engine: engine that simulates the lander; other environments are always Gymnasium's.

    Raises:
        UserError: there is no such environment, or it cannot be made.
    """
    if engine == "exact" and rules.is_lander(env_id):
        return ExactEnvPool(num_envs, spaces_of(env_id, engine), rules.settings_of(env_id))
    return StockEnvPool([make_env(env_id) for _ in range(num_envs)])


class StockEnvPool:
    """Gymnasium's environments, stepped one after the other.

    Args:
        envs: environments with one id, at least one.
    """

    def __init__(self, envs: Sequence[MadeEnv]) -> None:
        self._envs = [made.env for made in envs]
        self.spaces = envs[0].spaces

    def reset(self, index: int, seed: int) -> FloatArray:
        """Start an episode in one environment; return its first observation, [D]."""
        return self._envs[index].reset(seed=seed)[0]

    def step(self, indices: IntArray, actions: IntArray) -> StepResult:
        """Step some of the environments; see `EnvPool`."""
        stepped = [
            self._envs[index].step(action)[:4]
            for index, action in zip(_listed(indices), _listed(actions), strict=True)
        ]
        observations, rewards, terminated, truncated = zip(*stepped, strict=True)
        return StepResult(
            np.stack(observations),
            np.array(rewards),
            np.array(terminated),
            np.array(truncated),
        )

    def close(self) -> None:
        """Close them all."""
        for env in self._envs:
            env.close()


def _listed(numbers: IntArray) -> list[int]:
    return numbers.tolist()


class ExactEnvPool:
    """Landers of the exact engine, with the arrays of their latest step.

    Args:
        num_envs: N, at least 1.
        spaces: the lander's sizes.
        settings: the lander's settings, such as its gravity; None is stock's.
    """

    def __init__(
        self, num_envs: int, spaces: Spaces, settings: Mapping[str, Any] | None = None
    ) -> None:
        from touchdown.lander._engine import Batch  # noqa: PLC0415 - if it was built

        self.spaces = spaces
        num_threads = min(threads.threads(), -(-num_envs // _ENVS_PER_THREAD))
        self.batch = Batch(num_envs, num_threads=num_threads, **(settings or {}))
        self.actions = np.zeros(num_envs, np.int64)
        """[N], like all that follow."""
        self.observations = np.zeros((num_envs, rules.OBSERVATION_SIZE), np.float32)
        """[N, D]"""
        self.rewards = np.zeros(num_envs)
        self.terminated = np.zeros(num_envs, np.bool_)
        self.steps = np.zeros(num_envs, np.int64)
        """Steps since the start of each episode."""
        self._tasks = np.zeros(num_envs, np.uint8)

    def reset(self, index: int, seed: int) -> FloatArray:
        """Start an episode in one environment; return its first observation, [D]."""
        self.batch.seed(index, seed)
        self._advance(np.array([index]), rules.BEGIN)
        self.steps[index] = 0
        return self.observations[index].copy()

    def step(self, indices: IntArray, actions: IntArray) -> StepResult:
        """Step some of the environments; see `EnvPool`."""
        self.actions[indices] = actions
        self._advance(indices, rules.STEP)
        self.steps[indices] += 1
        return self.results(indices)

    def results(self, indices: IntArray) -> StepResult:
        """A copy of the results of the latest step of some of the environments."""
        return StepResult(
            self.observations[indices],
            self.rewards[indices],
            self.terminated[indices],
            self.steps[indices] >= rules.MAX_EPISODE_STEPS,
        )

    def _advance(self, indices: IntArray, task: int) -> None:
        self._tasks[:] = rules.NOTHING
        self._tasks[indices] = task
        self.batch.step(self.actions, self.observations, self.rewards, self.terminated, self._tasks)

    def close(self) -> None:
        """Do nothing: the engine holds only memory."""
