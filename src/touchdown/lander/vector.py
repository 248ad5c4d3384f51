"""Many landers on the exact engine, behind Gymnasium's interface."""

import struct
from collections.abc import Sequence
from copy import deepcopy
from itertools import combinations
from typing import Any, NamedTuple, Self, cast

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from touchdown.core.types import FloatArray
from touchdown.lander import picture
from touchdown.lander._engine import Batch
from touchdown.lander.rules import (
    BEGIN,
    MAX_EPISODE_STEPS,
    NOTHING,
    OBSERVATION_SIZE,
    limit_of,
)
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

_MAGIC = b"TDVECTOR"
_MOST_ENVS = 1_000_000  # several gigabytes; more is surely a typing error
_CLOCK = struct.Struct("<q?")  # step count, and whether the episode has ended
_OBSERVATION_BYTES = 4 * OBSERVATION_SIZE


class StepArrays(NamedTuple):
    """The arrays that a step writes its results to."""

    observations: NDArray[np.float32]  # [N, 8]
    rewards: NDArray[np.float64]  # [N]
    terminated: NDArray[np.bool_]  # [N]
    truncated: NDArray[np.bool_]  # [N]

    @classmethod
    def empty(cls, num_envs: int) -> Self:
        """Uninitialised arrays for N environments."""
        return cls(
            np.empty((num_envs, OBSERVATION_SIZE), np.float32),
            np.empty(num_envs),
            np.empty(num_envs, np.bool_),
            np.empty(num_envs, np.bool_),
        )


class LanderVectorEnv(gymnasium.vector.VectorEnv[FloatArray, NDArray[Any], NDArray[Any]]):
    """N landers that behave like a `SyncVectorEnv` of stock environments with a time limit.

    A copy or a pickle of it flies on identically. One thread at a time may use it; `num_threads`
    is about the engine's own.

    Args:
        num_envs: N.
        max_episode_steps: the time limit, in steps; -1 is none.
        autoreset_mode: Gymnasium's autoreset mode.
        num_threads: threads that share the landers; results do not depend on it.
        render_mode: `rgb_array`, or None if no pictures are wanted.
        continuous: whether an action is a pair of throttles, [main engine, side engine].
        gravity: between -12 and 0, m/s².
        enable_wind: whether there is wind.
        wind_power: force of the wind, N.
        turbulence_power: torque of the wind, N m.

    Raises:
        ValueError: a number is out of range.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int = MAX_EPISODE_STEPS,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        num_threads: int = 1,
        render_mode: str | None = None,
        continuous: bool = False,
        gravity: float = -10.0,
        enable_wind: bool = False,
        wind_power: float = 15.0,
        turbulence_power: float = 1.5,
    ) -> None:
        if num_envs > _MOST_ENVS:
            raise ValueError(f"num_envs = {num_envs}: must be at most {_MOST_ENVS}")
        picture.check_render_mode(render_mode)
        self._settings: dict[str, Any] = {
            "num_threads": num_threads,
            "continuous": continuous,
            "gravity": gravity,
            "enable_wind": enable_wind,
            "wind_power": wind_power,
            "turbulence_power": turbulence_power,
        }
        self._batch = Batch(num_envs, **self._settings)
        self._turn = Turn()
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {
            "render_modes": list(picture.RENDER_MODES),
            "render_fps": FPS,
            "autoreset_mode": self.autoreset_mode,
        }
        self.render_mode = render_mode
        self.single_observation_space = observation_space()
        self.single_action_space = action_space(continuous=continuous)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.closed = False
        self._limit = limit_of(max_episode_steps)
        self._actions: NDArray[Any] = (
            np.zeros((num_envs, 2), np.float32) if continuous else np.zeros(num_envs, np.int64)
        )
        self._observations = np.zeros((num_envs, OBSERVATION_SIZE), np.float32)  # the latest
        self._steps = np.zeros(num_envs, np.int64)
        self._ended = np.zeros(num_envs, np.bool_)
        self._tasks = np.zeros(num_envs, np.uint8)
        self._unused = StepArrays.empty(num_envs)  # a reset has no reward

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start an episode in each environment, with seeds seed, seed + 1, ...

        Args:
            seed: the first seed, or one for each environment; None continues its random stream.
            options: `reset_mask`, [N] booleans: only environments with True are reset.

        Raises:
            ValueError: the number of seeds is not N, or the mask has another shape or type.
            RuntimeError: another thread is using the environment.
        """
        self._need_open()
        seeds = self._seeds(seed)
        mask = self._mask(options)
        with self._turn:
            for i, (given, chosen) in enumerate(zip(seeds, mask.tolist(), strict=True)):
                if chosen and given is not None:
                    self._batch.seed(i, int(given))
            self._tasks[:] = np.where(mask, BEGIN, NOTHING)
            self._begin()
            self._ended &= ~mask
            return self._observations.copy(), {}

    def step(
        self, actions: NDArray[Any], *, out: StepArrays | None = None
    ) -> tuple[FloatArray, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Step every environment; ended episodes are reset according to the autoreset mode.

        Args:
            actions: [N] integers, or [N, 2] throttles.
            out: arrays to write to and return; new ones if None.

        Raises:
            ValueError: the actions or arrays have another shape or type, arrays share memory, an
                action is out of range, or an episode has ended and autoreset is disabled.
            RuntimeError: another thread is using the environment.
        """
        self._need_open()
        with self._turn:
            return self._step(actions, out)

    def _step(
        self, actions: NDArray[Any], out: StepArrays | None
    ) -> tuple[FloatArray, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            raise ValueError("environments whose episode ended must be reset before a step")
        taken = self._taken(actions)
        arrays = StepArrays.empty(self.num_envs) if out is None else self._checked(out)
        self._batch.step_episodes(taken, *arrays, self._steps, self._ended, self._limit)
        observations, rewards, terminated, truncated = arrays
        np.copyto(self._observations, observations)
        infos: dict[str, Any] = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._ended.any():
            final = np.full(self.num_envs, None, object)
            for i in np.flatnonzero(self._ended):
                final[i] = observations[i].copy()
            infos = {
                "final_obs": final,
                "_final_obs": self._ended.copy(),
                "final_info": {},
                "_final_info": self._ended.copy(),
            }
            np.multiply(self._ended, BEGIN, out=self._tasks, casting="unsafe")
            self._begin()
            np.copyto(observations, self._observations)
            self._ended[:] = False
        return observations, rewards, terminated, truncated, infos

    def close_extras(self, **kwargs: Any) -> None:
        """Do nothing: the engine holds memory only."""

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """A picture of each lander as it is now, RGB, [400, 600, 3]; None without a render mode.

        Raises:
            DependencyNotInstalled: the libraries for drawing are missing.
        """
        self._need_open()
        if self.render_mode is None:
            return None
        with self._turn:
            states = self.states()
            return tuple(
                picture.draw(states, i, self.terrain(i), int(self._steps[i]))
                for i in range(self.num_envs)
            )

    def states(self) -> LanderStates:
        """The physical states of all landers."""
        return read_states(self._batch)

    def terrain(self, index: int) -> FloatArray:
        """The corners of one environment's ground from left to right, metres, [11, 2]."""
        return read_terrain(self._batch, index)

    def coverage(self) -> dict[str, Any]:
        """Counts of rare paths taken in the physics since the environments were made."""
        return self._batch.coverage()

    def snapshot(self, index: int) -> bytes:
        """The complete state of one environment: physics, generator, step count, observation."""
        with self._turn:
            lander = self._batch.snapshot(index)
            clock = _CLOCK.pack(self._steps[index], self._ended[index])
            return seal(_MAGIC, clock + self._observations[index].tobytes() + lander)

    def restore(self, index: int, snapshot: bytes) -> None:
        """Continue one environment from a snapshot; nothing changes if the snapshot is refused.

        Raises:
            ValueError: the bytes are not a snapshot of an environment with these settings.
        """
        content = unseal(_MAGIC, snapshot, _CLOCK.size + _OBSERVATION_BYTES)
        steps, ended = _CLOCK.unpack_from(content)
        check_steps(steps, self._limit)
        observation, lander = (
            content[_CLOCK.size : _CLOCK.size + _OBSERVATION_BYTES],
            content[_CLOCK.size + _OBSERVATION_BYTES :],
        )
        with self._turn:
            self._batch.restore(index, lander)
            self._steps[index] = steps
            self._ended[index] = ended
            self._observations[index] = np.frombuffer(observation, np.float32)

    def copy_state(self, index: int, to: Sequence[int]) -> None:
        """Copy the state of one environment to others: physics, generator and step count.

        Raises:
            IndexError: there is no such environment.
        """
        with self._turn:
            self._batch.copy(index, to)
            for values in (self._steps, self._ended, self._observations):
                values[list(to)] = values[index]

    def __copy__(self) -> Self:
        """A copy of its own: a shallow one would share the arrays that a step writes to."""
        return deepcopy(self)

    def __getstate__(self) -> dict[str, Any]:
        """All attributes; snapshots stand for the engine."""
        own = {name: value for name, value in vars(self).items() if name not in ("_batch", "_turn")}
        return own | {"snapshots": [self.snapshot(index) for index in range(self.num_envs)]}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Fly on from what `__getstate__` gave.

        Raises:
            ValueError: a snapshot is damaged.
        """
        snapshots = state.pop("snapshots")
        vars(self).update(state)
        self._turn = Turn()
        self._batch = Batch(self.num_envs, **self._settings)
        for index, snapshot in enumerate(snapshots):
            self.restore(index, snapshot)

    def _need_open(self) -> None:
        if self.closed:
            raise ClosedEnvironmentError("the environment is closed; make a new one")

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            seed = [int(seed) + i for i in range(self.num_envs)]
        given: Any = seed
        if not isinstance(given, Sequence | np.ndarray):
            raise ValueError(f"seed = {seed!r}: must be a whole number, or one per environment")
        if len(seed) != self.num_envs:
            raise ValueError(f"seed has {len(seed)} entries, must have {self.num_envs}")
        for i, each in enumerate(cast(Sequence[Any], given)):
            if each is not None and not (isinstance(each, int | np.integer) and each >= 0):
                raise ValueError(f"seed[{i}] = {each!r}: must be a whole number, at least 0")
        return seed

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        if options is None or "reset_mask" not in options:
            return np.ones(self.num_envs, np.bool_)
        mask = np.asarray(options["reset_mask"])
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
            raise ValueError(
                f"reset_mask is {mask.dtype}{mask.shape}: must be bool({self.num_envs},) "
                "with at least one true entry"
            )
        return mask

    def _begin(self) -> None:
        """Start an episode in environments with the task BEGIN, and reset their step counts."""
        unused = self._unused
        self._batch.step(
            self._actions, self._observations, unused.rewards, unused.terminated, self._tasks
        )
        np.putmask(self._steps, self._tasks == BEGIN, 0)

    def _taken(self, actions: NDArray[Any]) -> NDArray[Any]:
        """The actions as the engine takes them, copied only if they are of another type or order.

        Raises:
            ValueError: they have another shape, or a type that cannot be cast to the engine's.
        """
        given = np.asarray(actions)
        taken = self._actions
        if (
            given.dtype == taken.dtype
            and given.shape == taken.shape
            and given.flags.c_contiguous
            and given.flags.aligned
        ):
            return given
        if given.shape != taken.shape or not np.can_cast(given.dtype, taken.dtype, "same_kind"):
            raise ValueError(
                f"actions are {given.dtype}{given.shape}, must be {taken.dtype}{taken.shape}"
            )
        np.copyto(taken, given, casting="same_kind")
        return taken

    def _checked(self, out: StepArrays) -> StepArrays:
        for name, given, wanted in zip(StepArrays._fields, out, self._unused, strict=True):
            if not isinstance(cast(object, given), np.ndarray):
                raise ValueError(f"out.{name} is a {type(given).__name__}, must be an array")
            if (given.shape, given.dtype) != (wanted.shape, wanted.dtype):
                raise ValueError(
                    f"out.{name} is {given.dtype}{given.shape}, "
                    f"must be {wanted.dtype}{wanted.shape}"
                )
            if not (given.flags.c_contiguous and given.flags.writeable):
                raise ValueError(f"out.{name} must be contiguous and writable")
        for (name, one), (other_name, other) in combinations(
            zip(StepArrays._fields, out, strict=True), 2
        ):
            if np.may_share_memory(one, other):  # exact, as they are contiguous
                raise ValueError(f"out.{name} and out.{other_name} must not share memory")
        return out
