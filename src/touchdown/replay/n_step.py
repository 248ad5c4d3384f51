"""n-step transitions: the discounted sum of n rewards, and the observation after them."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchdown.core.types import FloatArray, Tensors
from touchdown.replay.transition import Transition


class NStep:
    """Turns single steps into n-step transitions (Sutton, 1988; Watkins, 1989).

    R = r₁ + γ·r₂ + ... + γⁿ⁻¹·rₙ, and the bootstrap is discounted by γⁿ, or by 0 if the episode
    terminated within the n steps. Near the end of an episode, transitions span the fewer steps that
    remain.

    Args:
        n: steps, at least 1.
        gamma: γ.
        needs_next_action: whether a transition includes the action after its last step (SARSA's
            a′), so that it is complete one step later.

    Raises:
        ValueError: n is less than 1.
    """

    def __init__(self, n: int, gamma: float, *, needs_next_action: bool = False) -> None:
        if n < 1:
            raise ValueError(f"n must be at least 1 step, got {n}")
        self._n = n
        self._gamma = gamma
        self._needs_next_action = needs_next_action
        self._steps: deque[tuple[FloatArray, int, float]] = deque()
        self._last: FloatArray | None = None  # the observation after the newest step

    def push(
        self, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray, *, terminated: bool
    ) -> list[Transition]:
        """Add one step.

        Args:
            o_tm1: the observation before it, [D].
            a_tm1: the action.
            r_t: the reward.
            o_t: the observation after it, [D].
            terminated: whether the episode terminated.

        Returns:
            The transitions that this step completes, oldest first.
        """
        if self._n > 1 or self._needs_next_action:
            # copies, because the caller may overwrite its arrays after this call
            o_tm1, o_t = o_tm1.copy(), o_t.copy()
        complete: list[Transition] = []
        if self._needs_next_action and len(self._steps) == self._n:
            complete.append(self._pop_oldest(a_t=a_tm1))
        self._steps.append((o_tm1, a_tm1, r_t))
        self._last = o_t
        if terminated:
            return complete + self._drain(terminated=True)
        if not self._needs_next_action and len(self._steps) == self._n:
            complete.append(self._pop_oldest())
        return complete

    def truncate(self, a_t: int = 0) -> list[Transition]:
        """End an episode that was truncated after the latest step.

        Args:
            a_t: the action that would have been taken next; used only with `needs_next_action`.

        Returns:
            The incomplete transitions, oldest first; they all bootstrap.
        """
        return self._drain(terminated=False, a_t=a_t)

    def tensors(self) -> Tensors:
        """The K steps that are in no transition yet, for a checkpoint; {} if there are none.

        `o_tm1` [K, D], `a_tm1` [K], `r_t` [K], and `last` [D], the observation after the newest.
        """
        if not self._steps or self._last is None:
            return {}
        o_tm1, a_tm1, r_t = zip(*self._steps, strict=True)
        return {
            "o_tm1": np.stack(o_tm1),
            "a_tm1": np.array(a_tm1, np.int64),
            "r_t": np.array(r_t, np.float64),
            "last": self._last,
        }

    def restore(self, tensors: Tensors) -> None:
        """Set the steps to what `tensors` returned.

        Raises:
            KeyError: an array is missing.
            ValueError: they are not of one length, or more than a transition spans.
        """
        self._steps.clear()
        if not tensors:
            return
        if len(tensors["r_t"]) > self._n:
            raise ValueError(f"n_step holds {len(tensors['r_t'])} steps, must be {self._n} or less")
        parts = tensors["o_tm1"].copy(), tensors["a_tm1"].tolist(), tensors["r_t"].tolist()
        self._steps.extend(zip(*parts, strict=True))
        self._last = tensors["last"].copy()

    def _drain(self, *, terminated: bool, a_t: int = 0) -> list[Transition]:
        return [self._pop_oldest(terminated=terminated, a_t=a_t) for _ in range(len(self._steps))]

    def _pop_oldest(self, *, terminated: bool = False, a_t: int = 0) -> Transition:
        assert self._last is not None  # noqa: S101 - set with every step
        total = 0.0
        for _, _, reward in reversed(self._steps):
            total = reward + self._gamma * total
        discount = 0.0 if terminated else self._gamma ** len(self._steps)
        o_tm1, a_tm1, _ = self._steps.popleft()
        return Transition(o_tm1, a_tm1, total, discount, terminated, a_t, self._last)


class Windows(NamedTuple):
    """The unfinished steps of N environments in arrays of one size, n steps for each."""

    o_tm1: NDArray[np.float32]
    """[N, n, D]"""
    a_tm1: NDArray[np.int32]
    """[N, n]"""
    r_t: NDArray[np.float64]
    """[N, n]"""
    lengths: NDArray[np.int64]
    """[N]: how many of the n steps there are; the first ones, the oldest first."""

    @classmethod
    def empty(cls, num_envs: int, n: int, observation_size: int) -> "Windows":
        """Arrays without steps."""
        return cls(
            np.zeros((num_envs, n, observation_size), np.float32),
            np.zeros((num_envs, n), np.int32),
            np.zeros((num_envs, n)),
            np.zeros(num_envs, np.int64),
        )

    def read(self, windows: Sequence[NStep]) -> None:
        """Copy the steps of N environments into the arrays."""
        for index, window in enumerate(windows):
            held = window.tensors()
            self.lengths[index] = count = len(held["r_t"]) if held else 0
            if count:
                self.o_tm1[index, :count] = held["o_tm1"]
                self.a_tm1[index, :count] = held["a_tm1"]
                self.r_t[index, :count] = held["r_t"]

    def write(self, windows: Sequence[NStep], observations: FloatArray) -> None:
        """Set the steps of N environments to those in the arrays.

        Args:
            windows: the environments' steps.
            observations: the observation after the newest step of each, [N, D].
        """
        for index, window in enumerate(windows):
            count = int(self.lengths[index])
            held = {
                "o_tm1": self.o_tm1[index, :count],
                "a_tm1": self.a_tm1[index, :count],
                "r_t": self.r_t[index, :count],
                "last": observations[index],
            }
            window.restore(held if count else {})


def tensors_of(windows: Sequence[NStep]) -> Tensors:
    """The unfinished steps of N environments; names begin with the number of the environment."""
    return {
        f"{index}.{name}": array
        for index, window in enumerate(windows)
        for name, array in window.tensors().items()
    }


def restore(windows: Sequence[NStep], tensors: Tensors) -> None:
    """Set the unfinished steps of N environments to what `tensors_of` returned.

    Raises:
        KeyError: an array is missing.
        ValueError: something does not fit.
    """
    for index, window in enumerate(windows):
        names = (name for name in tensors if name.partition(".")[0] == str(index))
        window.restore({name.partition(".")[2]: tensors[name] for name in names})
