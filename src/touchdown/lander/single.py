"""One lander on the exact engine, behind Gymnasium's interface."""

import struct
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray

from touchdown.core.types import FloatArray
from touchdown.lander._engine import HELIPAD, Batch
from touchdown.lander.rules import BEGIN, OBSERVATION_SIZE
from touchdown.lander.snapshots import seal, unseal
from touchdown.lander.space import (
    LanderStates,
    action_space,
    observation_space,
    read_states,
    read_terrain,
)
from touchdown.lander.stock import FPS

_MAGIC = b"TDSINGLE"
_CLOCK = struct.Struct("<q")  # the step count, before the engine's part
_BEGIN = np.array([BEGIN], np.uint8)


class LanderEnv(gymnasium.Env[FloatArray, Any]):
    """LunarLander-v3 on the exact engine; Gymnasium's registration adds the time limit.

    Args:
        render_mode: must be None; films are made from recorded flights.
        max_episode_steps: time limit without Gymnasium's wrapper, with the step count in snapshots.
        continuous: whether an action is a pair of throttles, [main engine, side engine].
        gravity: between -12 and 0, m/s².
        enable_wind: whether there is wind.
        wind_power: force of the wind, N.
        turbulence_power: torque of the wind, N m.

    Raises:
        ValueError: a number is out of range.
    """

    helipad = HELIPAD
    """x of the left flag, x of the right flag, and height of the pad, m."""
    metadata: dict[str, Any] = {"render_modes": [], "render_fps": FPS}  # noqa: RUF012 - as Gymnasium's

    def __init__(
        self,
        render_mode: str | None = None,
        *,
        max_episode_steps: int | None = None,
        continuous: bool = False,
        gravity: float = -10.0,
        enable_wind: bool = False,
        wind_power: float = 15.0,
        turbulence_power: float = 1.5,
    ) -> None:
        if render_mode is not None:
            raise ValueError(
                f"render_mode {render_mode!r}: must be None; films are made from recorded flights"
            )
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
        self._closed = False
        self._limit = max_episode_steps
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start an episode; without a seed the random stream continues."""
        self._need_open()
        super().reset(seed=seed, options=options)
        if seed is not None:
            self._batch.seed(0, int(seed))
        self._steps = 0
        return self._advance(_BEGIN), {}

    def step(self, action: Any) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Advance by one step, 1/50 s.

        Raises:
            ValueError: the action is not in the action space.
        """
        self._need_open()
        self._actions[0] = self._checked(action)
        observation = self._advance(None)
        self._steps += 1
        truncated = self._limit is not None and self._steps >= self._limit
        return observation, float(self._rewards[0]), bool(self._terminated[0]), truncated, {}

    def close(self) -> None:
        """Close the environment; every later call raises."""
        self._closed = True

    def states(self) -> LanderStates:
        """The physical state of the lander, with N = 1."""
        return read_states(self._batch)

    def terrain(self) -> FloatArray:
        """The corners of the ground from left to right, metres, [11, 2]."""
        return read_terrain(self._batch, 0)

    def coverage(self) -> dict[str, Any]:
        """Counts of rare paths taken in the physics since the environment was made."""
        return self._batch.coverage()

    def snapshot(self) -> bytes:
        """The complete state, including the random generator and the step count."""
        return seal(_MAGIC, _CLOCK.pack(self._steps) + self._batch.snapshot(0))

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot.

        Raises:
            ValueError: the bytes are not a snapshot of an environment with these settings.
        """
        content = unseal(_MAGIC, snapshot, "a lander")
        (steps,) = _CLOCK.unpack_from(content)
        if steps < 0:
            raise ValueError(f"the snapshot is damaged: it has {steps} steps")
        self._batch.restore(0, content[_CLOCK.size :])
        self._steps = steps

    def _advance(self, task: NDArray[np.uint8] | None) -> FloatArray:
        observation = np.empty((1, OBSERVATION_SIZE), np.float32)
        self._batch.step(self._actions, observation, self._rewards, self._terminated, task)
        return observation[0]

    def _checked(self, action: Any) -> Any:
        if self.continuous:
            pair = np.asarray(action)
            if pair.shape == (2,) and pair.dtype.kind in "fiu":
                return pair
            wanted = "a pair of numbers (main engine, side engine)"
        else:
            number = np.asarray(action)
            if number.shape == () and number.dtype.kind in "iu" and 0 <= number < 4:
                return number
            wanted = "a whole number from 0 to 3"
        raise ValueError(f"action {action!r}: must be {wanted}")

    def _need_open(self) -> None:
        if self._closed:
            raise ClosedEnvironmentError("the environment is closed; make a new one")
