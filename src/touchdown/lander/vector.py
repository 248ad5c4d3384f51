"""The exact engine behind Gymnasium's interfaces: one lander, or many at once."""

from collections.abc import Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from touchdown.lander.engine import Batch
from touchdown.lander.env import MAX_EPISODE_STEPS, OBSERVATION_SIZE
from touchdown.types import FloatArray

# as stock's: the observation's units are half viewports, and so on; see gymnasium's lunar_lander.py
_HIGH = np.array([2.5, 2.5, 10, 10, 2 * np.pi, 10, 1, 1], np.float32)
_LOW = np.array([-2.5, -2.5, -10, -10, -2 * np.pi, -10, 0, 0], np.float32)


def observation_space() -> spaces.Box:
    """Stock's."""
    return spaces.Box(_LOW, _HIGH)


def action_space(*, continuous: bool) -> spaces.Space[Any]:
    """Stock's."""
    return spaces.Box(-1, +1, (2,), np.float32) if continuous else spaces.Discrete(4)


class LanderEnv(gymnasium.Env[FloatArray, Any]):
    """LunarLander-v3 on the exact engine; Gymnasium's registration adds the limit of 1000 steps.

    Args:
        render_mode: None; flights are drawn from their records.
        continuous: whether an action is a pair of throttles.
        gravity: between -12 and 0, m/s².
        enable_wind: whether the wind blows.
        wind_power: its force, N.
        turbulence_power: its torque, N m.

    Raises:
        ValueError: a number is out of range.
    """

    metadata: dict[str, Any] = {"render_modes": [], "render_fps": 50}  # noqa: RUF012 - as Gymnasium's

    def __init__(
        self,
        render_mode: str | None = None,
        *,
        continuous: bool = False,
        gravity: float = -10.0,
        enable_wind: bool = False,
        wind_power: float = 15.0,
        turbulence_power: float = 1.5,
    ) -> None:
        if render_mode is not None:
            raise ValueError(f"render_mode {render_mode!r}: must be None; flights are drawn later")
        self.render_mode = None
        self.observation_space = cast(spaces.Space[FloatArray], observation_space())
        self.action_space = action_space(continuous=continuous)
        self.continuous = continuous
        self._batch = Batch(
            1,
            continuous=continuous,
            gravity=gravity,
            enable_wind=enable_wind,
            wind_power=wind_power,
            turbulence_power=turbulence_power,
        )
        self._actions: NDArray[Any] = (
            np.zeros((1, 2), np.float32) if continuous else np.zeros(1, int)
        )
        self._rewards = np.zeros(1)
        self._terminated = np.zeros(1, np.bool_)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start an episode; without a seed the stream of random numbers goes on."""
        super().reset(seed=seed, options=options)
        observation = np.empty(OBSERVATION_SIZE, np.float32)
        self._batch.reset(0, seed, observation)
        return observation, {}

    def step(self, action: Any) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """One fiftieth of a second.

        Raises:
            ValueError: the action is none of the space's.
        """
        self._actions[0] = action
        observation = np.empty((1, OBSERVATION_SIZE), np.float32)
        self._batch.step(self._actions, observation, self._rewards, self._terminated)
        return observation[0], float(self._rewards[0]), bool(self._terminated[0]), False, {}

    def snapshot(self) -> bytes:
        """The whole state, generator included."""
        return self._batch.snapshot(0)

    def restore(self, snapshot: bytes) -> None:
        """Go on from a snapshot.

        Raises:
            ValueError: the bytes are no snapshot of an environment with these settings.
        """
        self._batch.restore(0, snapshot)


class LanderVectorEnv(gymnasium.vector.VectorEnv[FloatArray, NDArray[Any], NDArray[Any]]):
    """Many landers at once, as `SyncVectorEnv` of stock environments with a limit of 1000 steps.

    Args:
        num_envs: N.
        max_episode_steps: the limit, in steps.
        autoreset_mode: Gymnasium's.
        settings: `continuous`, `gravity`, `enable_wind`, `wind_power`, `turbulence_power`.

    Raises:
        ValueError: a number is out of range.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int = MAX_EPISODE_STEPS,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **settings: Any,
    ) -> None:
        self._batch = Batch(num_envs, **settings)
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {
            "render_modes": [],
            "render_fps": 50,
            "autoreset_mode": self.autoreset_mode,
        }
        continuous = bool(settings.get("continuous", False))
        self.single_observation_space = observation_space()
        self.single_action_space = action_space(continuous=continuous)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._limit = max_episode_steps
        self._action_dtype = np.float32 if continuous else np.int64
        self._action_shape = (num_envs, 2) if continuous else (num_envs,)
        self._steps = np.zeros(num_envs, np.int64)
        self._ended = np.zeros(num_envs, np.bool_)
        self.closed = False

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start an episode in each environment, with the seeds seed, seed + 1, ...

        Raises:
            ValueError: there are not as many seeds as environments.
        """
        del options
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        seeds = [None] * self.num_envs if seeds is None else list(seeds)
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed has {len(seeds)} entries, must have {self.num_envs}")
        observations = np.empty((self.num_envs, OBSERVATION_SIZE), np.float32)
        for i, each in enumerate(seeds):
            self._batch.reset(i, each, observations[i])
        self._steps[:] = 0
        self._ended[:] = False
        return observations, {}

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[FloatArray, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """One step of every environment; those that have ended begin again, as the mode says.

        Raises:
            ValueError: the actions are of another shape or type, or out of range.
        """
        given = np.ascontiguousarray(actions)
        if given.shape != self._action_shape or not np.can_cast(
            given.dtype, self._action_dtype, "same_kind"
        ):
            raise ValueError(
                f"actions are {given.dtype}{given.shape}, must be "
                f"{np.dtype(self._action_dtype)}{self._action_shape}"
            )
        observations = np.empty((self.num_envs, OBSERVATION_SIZE), np.float32)
        rewards = np.zeros(self.num_envs)
        terminated = np.zeros(self.num_envs, np.bool_)
        flying = ~self._ended
        if not flying.all() and self.autoreset_mode == AutoresetMode.DISABLED:
            raise ValueError("environments that have ended must be reset before they are stepped")
        self._batch.step(
            given.astype(self._action_dtype, copy=False), observations, rewards, terminated, flying
        )
        self._steps += flying
        truncated = flying & (self._steps >= self._limit)
        for i in np.flatnonzero(self._ended):
            self._begin(int(i), observations)
        self._ended = terminated | truncated
        infos: dict[str, Any] = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._ended.any():
            final = np.full(self.num_envs, None, object)
            for i in np.flatnonzero(self._ended):
                final[i] = observations[i].copy()
                self._begin(int(i), observations)
            infos = {
                "final_obs": final,
                "_final_obs": self._ended.copy(),
                "final_info": {},
                "_final_info": self._ended.copy(),
            }
            self._ended = np.zeros(self.num_envs, np.bool_)
        return observations, rewards, terminated, truncated, infos

    def _begin(self, index: int, observations: FloatArray) -> None:
        self._batch.reset(index, None, observations[index])
        self._steps[index] = 0

    def snapshot(self, index: int) -> bytes:
        """The whole state of one environment, generator and step count included."""
        count = int(self._steps[index]).to_bytes(8, "little", signed=True)
        return count + bytes([int(self._ended[index])]) + self._batch.snapshot(index)

    def restore(self, index: int, snapshot: bytes) -> None:
        """Have one environment go on from a snapshot.

        Raises:
            ValueError: the bytes are no snapshot of an environment with these settings.
        """
        self._batch.restore(index, snapshot[9:])
        self._steps[index] = int.from_bytes(snapshot[:8], "little", signed=True)
        self._ended[index] = bool(snapshot[8])
