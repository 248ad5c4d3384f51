"""ε-greedy action selection and how ε changes over time (section 2, Eq. 3)."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from touchdown.config.sections import ExplorationConfig
from touchdown.core.types import FloatArray, IntArray

Schedule = Callable[[int], float]
"""ε as a function of time: of observations or of episodes, as each schedule says."""


def constant(value: float) -> Schedule:
    """Always `value`."""
    return lambda _: value


def linear(start: float, end: float, duration: int) -> Schedule:
    """From `start` to `end` in a straight line over `duration`, `end` ever after."""

    def schedule(time: int) -> float:
        return end + (start - end) * max(0.0, 1.0 - time / duration)

    return schedule


def exponential(start: float, end: float, factor: float) -> Schedule:
    """`start · factor^time`, never below `end` (the paper's, counted in episodes)."""

    def schedule(time: int) -> float:
        return max(end, start * factor**time)

    return schedule


def explore(epsilon: float, count: int, rng: Generator) -> NDArray[np.bool_]:
    """Which of `count` actions are random ones (Eq. 3). Draws as many numbers, whatever ε is."""
    return rng.random(count) < epsilon


def make_schedule(config: ExplorationConfig) -> Callable[[int, int], float]:
    """The configured ε as a function of (episode, observations so far)."""
    match config.schedule:
        case "constant":
            schedule = constant(config.epsilon_start)
            return lambda _episode, _observations: schedule(0)
        case "linear":
            schedule = linear(config.epsilon_start, config.epsilon_end, config.epsilon_duration)
            return lambda _episode, observations: schedule(observations)
        case "exponential":
            schedule = exponential(config.epsilon_start, config.epsilon_end, config.epsilon_decay)
            return lambda episode, _observations: schedule(episode)


class EpsilonGreedy:
    """Chooses actions in N worlds (Eq. 3), and keeps ε at what its schedule says.

    Args:
        config: the schedule.
        num_actions: A.
        rng: draws whether to explore, and what.
    """

    def __init__(self, config: ExplorationConfig, num_actions: int, rng: Generator) -> None:
        self.epsilon = 1.0
        self._epsilon_of = make_schedule(config)
        self._by_observations = config.schedule == "linear"
        self._num_actions = num_actions
        self._rng = rng

    def begin_episode(self, ended: int, observations: int) -> None:
        """An episode begins after `ended` others and so many observations."""
        self.epsilon = self._epsilon_of(ended, observations)

    def observed(self, observations: int) -> None:
        """There are so many observations now."""
        if self._by_observations:
            self.epsilon = self._epsilon_of(0, observations)

    def act(self, count: int, values: Callable[[], FloatArray]) -> IntArray:
        """Actions of `count` worlds, [N].

        Args:
            count: N.
            values: gives Q(s,·) of each world, [N, A]; asked only where an action hangs on it.
        """
        explores = explore(self.epsilon, count, self._rng)
        number = np.count_nonzero(explores)
        actions = np.zeros(count, np.int64) if number == count else values().argmax(axis=1)
        if number:
            actions[explores] = self._rng.integers(self._num_actions, size=number)
        return actions
