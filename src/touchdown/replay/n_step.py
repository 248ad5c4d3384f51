"""Transitions over several steps: the rewards of n steps in one, and the observation after them."""

from collections import deque

from touchdown.core.types import FloatArray
from touchdown.replay.transition import Transition


class NStep:
    """Makes transitions of n steps out of single ones (Sutton, 1988; Watkins, 1989).

    R = r₁ + γ·r₂ + ... + γⁿ⁻¹·rₙ, and the bootstrap is discounted by γⁿ; by 0 where the world ended
    on the way. Towards the end of an episode there are fewer steps left, and fewer are taken.

    Args:
        n: steps, at least 1.
        gamma: γ.
        waits: for the action after the last of the steps, which makes a transition whole one step
            later (SARSA's five parts).
    """

    def __init__(self, n: int, gamma: float, *, waits: bool = False) -> None:
        if n < 1:
            raise ValueError(f"n must be at least 1 step, got {n}")
        self._n = n
        self._gamma = gamma
        self._waits = waits
        self._steps: deque[tuple[FloatArray, int, float]] = deque()
        self._last: FloatArray | None = None  # the observation after the newest step

    def push(
        self, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray, *, terminated: bool
    ) -> list[Transition]:
        """Take in one step; gives the transitions that are whole by it, the oldest first."""
        if self._n > 1 or self._waits:  # they wait here, and their owner may write over them
            o_tm1, o_t = o_tm1.copy(), o_t.copy()
        whole: list[Transition] = []
        if self._waits and len(self._steps) == self._n:
            whole.append(self._oldest(a_t=a_tm1))
        self._steps.append((o_tm1, a_tm1, r_t))
        self._last = o_t
        if terminated:
            return whole + self._drain(terminated=True)
        if not self._waits and len(self._steps) == self._n:
            whole.append(self._oldest())
        return whole

    def cut(self, a_t: int = 0) -> list[Transition]:
        """The episode was cut off after the newest step: the transitions that were under way.

        Args:
            a_t: the action that would have been taken next, for whoever waits for it.
        """
        return self._drain(terminated=False, a_t=a_t)

    def _drain(self, *, terminated: bool, a_t: int = 0) -> list[Transition]:
        return [self._oldest(terminated=terminated, a_t=a_t) for _ in range(len(self._steps))]

    def _oldest(self, *, terminated: bool = False, a_t: int = 0) -> Transition:
        assert self._last is not None  # noqa: S101 - there is a step, so there is one after it
        total = 0.0
        for _, _, reward in reversed(self._steps):
            total = reward + self._gamma * total
        discount = 0.0 if terminated else self._gamma ** len(self._steps)
        o_tm1, a_tm1, _ = self._steps.popleft()
        return Transition(o_tm1, a_tm1, total, discount, self._last, terminated, a_t)
