"""One lander on the exact engine, behind Gymnasium's interface."""

import struct
from copy import deepcopy
from typing import Any, Self, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray

from touchdown.core.types import FloatArray
from touchdown.lander import picture
from touchdown.lander._engine import HELIPAD, Batch
from touchdown.lander.rules import BEGIN, OBSERVATION_SIZE, limit_of
from touchdown.lander.snapshots import check_steps, seal, unseal
from touchdown.lander.space import (
    LanderStates,
    action_space,
    observation_space,
    read_states,
    read_terrain,
)
from touchdown.lander.stock import FPS
from touchdown.lander.turn import Turn

_MAGIC = b"TDSINGLE"
_STEPS = struct.Struct("<q")  # before the engine's part
_BEGIN = np.array([BEGIN], np.uint8)


class LanderEnv(gymnasium.Env[FloatArray, Any]):
    """LunarLander-v3 on the exact engine; Gymnasium's registration adds the time limit.

    A copy or a pickle of it flies on identically. One thread at a time may use it.

    Args:
        render_mode: `rgb_array`, or None if no pictures are wanted.
        max_episode_steps: time limit without Gymnasium's wrapper, with the step count in snapshots;
            None or -1 is none.
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
    metadata: dict[str, Any] = {  # noqa: RUF012 - as Gymnasium's
        "render_modes": list(picture.RENDER_MODES),
        "render_fps": FPS,
    }

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
        picture.check_render_mode(render_mode)
        self.render_mode = render_mode
        self.observation_space = cast(spaces.Space[FloatArray], observation_space())
        self.action_space = action_space(continuous=continuous)
        self.continuous = continuous
        self._settings: dict[str, Any] = {
            "continuous": continuous,
            "gravity": gravity,
            "enable_wind": enable_wind,
            "wind_power": wind_power,
            "turbulence_power": turbulence_power,
        }
        self._batch = Batch(1, **self._settings)
        self._turn = Turn()
        self._actions: NDArray[Any] = (
            np.zeros((1, 2), np.float32) if continuous else np.zeros(1, int)
        )
        self._rewards = np.zeros(1)
        self._terminated = np.zeros(1, np.bool_)
        self._closed = False
        self._limit = limit_of(max_episode_steps)
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start an episode; without a seed the random stream continues.

        Raises:
            RuntimeError: another thread is using the environment.
        """
        self._need_open()
        with self._turn:
            super().reset(seed=seed, options=options)
            if seed is not None:
                self._batch.seed(0, int(seed))
            self._steps = 0
            return self._advance(_BEGIN), {}

    def step(self, action: Any) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Advance by one step, 1/50 s.

        Raises:
            ValueError: the action is not in the action space.
            RuntimeError: another thread is using the environment.
        """
        self._need_open()
        with self._turn:
            self._actions[0] = self._checked(action)
            observation = self._advance(None)
            self._steps += 1
            truncated = self._steps >= self._limit
            return observation, float(self._rewards[0]), bool(self._terminated[0]), truncated, {}

    def render(self) -> NDArray[np.uint8] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The lander as it is now, RGB, [400, 600, 3]; None without a render mode.

        Raises:
            DependencyNotInstalled: the libraries for drawing are missing.
        """
        self._need_open()
        if self.render_mode is None:
            return None
        with self._turn:
            return picture.draw(self.states(), 0, self.terrain(), self._steps)

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
        with self._turn:
            return seal(_MAGIC, _STEPS.pack(self._steps) + self._batch.snapshot(0))

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot; nothing changes if it is refused.

        Raises:
            ValueError: the bytes are not a snapshot of an environment with these settings.
        """
        content = unseal(_MAGIC, snapshot, _STEPS.size)
        (steps,) = _STEPS.unpack_from(content)
        check_steps(steps, limit_of(None))  # stock, too, may be stepped beyond its limit
        with self._turn:
            self._batch.restore(0, content[_STEPS.size :])
            self._steps = steps

    def __copy__(self) -> Self:
        """A copy of its own: a shallow one would share the arrays that a step writes to."""
        return deepcopy(self)

    def __getstate__(self) -> dict[str, Any]:
        """All attributes; a snapshot stands for the engine."""
        own = {name: value for name, value in vars(self).items() if name not in ("_batch", "_turn")}
        return own | {"snapshot": self.snapshot()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Fly on from what `__getstate__` gave.

        Raises:
            ValueError: its snapshot is damaged.
        """
        snapshot = state.pop("snapshot")
        vars(self).update(state)
        self._turn = Turn()
        self._batch = Batch(1, **self._settings)
        self.restore(snapshot)

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
