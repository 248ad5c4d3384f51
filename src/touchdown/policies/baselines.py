"""Policies without training: Gymnasium's heuristic, random actions, and the PID's gains."""

import hashlib
from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from touchdown.config import toml
from touchdown.control.pid import PIDConfig, Rule
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray, IntArray


class HeuristicPolicy:
    """The controller that Gymnasium ships with its lander."""

    def __init__(self) -> None:
        from gymnasium.envs.box2d import lunar_lander  # noqa: PLC0415 - it loads Box2D

        self._heuristic: Any = lunar_lander.heuristic
        # the heuristic reads only whether the environment's actions are continuous
        self._env = gymnasium.make("LunarLander-v3", disable_env_checker=True).unwrapped

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, 8] to [N]."""
        return np.array([self._heuristic(self._env, o) for o in observations])


class RandomPolicy:
    """Uniform random actions, each a hash of the episode's start and the step.

    A random generator would be shared by the episodes of a batch; with a hash, an episode does not
    depend on the others. A hash of the observation would be one fixed policy in an environment
    with few states.

    Args:
        num_actions: number of actions.
    """

    def __init__(self, num_actions: int) -> None:
        self._num_actions = num_actions
        self._rng = np.random.default_rng(0)

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation, [N, D] to [N], where nobody knows start and step."""
        return self._rng.integers(self._num_actions, size=len(observations))

    def act_at(self, observations: FloatArray, seeds: IntArray, steps: IntArray) -> IntArray:
        """An action for each observation, [N, D] to [N]; see `SeededPolicy`."""
        del observations
        draws = np.stack([seeds, steps], axis=1).astype("<i8")
        digests = (hashlib.blake2b(row.tobytes(), digest_size=8).digest() for row in draws)
        return np.array([int.from_bytes(digest) % self._num_actions for digest in digests])


def shipped_pid(rule: Rule | None = None) -> PIDConfig:
    """The shipped gains for a rule, tuned by `touchdown tune pid`; by default the better rule."""
    name = f"pid_{rule or 'signed'}.toml"
    with resources.as_file(resources.files("touchdown.control") / name) as path:
        return read_pid(path)


def read_pid(path: Path) -> PIDConfig:
    """Gains from a TOML file, as written by `touchdown tune pid`.

    Raises:
        UserError: it cannot be read, or a field is unknown or invalid.
    """
    start = PIDConfig(
        rule="signed", kp_vertical=0, ki_vertical=0, kp_angle=0, kd_angle=0, dead_band=0
    )
    values = toml.read_toml(path)
    gains = toml.replace_fields(start, values, str(path))
    missing = [item.name for item in fields(start) if item.name not in values]
    if missing:
        raise UserError(f"{path}: {', '.join(missing)}: missing; a PID needs every gain")
    return gains
