"""ε-greedy action selection and schedules of ε (section 2, Eq. 3)."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from touchdown.config.sections import ExplorationConfig
from touchdown.core.types import FloatArray, IntArray

Schedule = Callable[[int], float]
"""A value as a function of time, counted in environment steps, updates or episodes."""


def constant(value: float) -> Schedule:
    """Always `value`."""
    return lambda _: value


def linear(start: float, end: float, duration: int) -> Schedule:
    """From `start` to `end` in a straight line over `duration`, then constant."""

    def schedule(time: int) -> float:
        return end + (start - end) * max(0.0, 1.0 - time / duration)

    return schedule


def exponential(start: float, end: float, factor: float) -> Schedule:
    """`start · factor^time`, never below `end` (as in the paper, with time counted in episodes)."""

    def schedule(time: int) -> float:
        return max(end, start * factor**time)

    return schedule


def explore(epsilon: float, count: int, rng: Generator) -> NDArray[np.bool_]:
    """Which of `count` actions are random (Eq. 3). Always draws `count` numbers."""
    return rng.random(count) < epsilon


def make_schedule(config: ExplorationConfig) -> Callable[[int, int], float]:
    """The configured ε as a function of (episode, environment steps)."""
    match config.schedule:
        case "constant":
            schedule = constant(config.epsilon_start)
            return lambda _episode, _env_steps: schedule(0)
        case "linear":
            schedule = linear(config.epsilon_start, config.epsilon_end, config.epsilon_duration)
            return lambda _episode, env_steps: schedule(env_steps)
        case "exponential":
            schedule = exponential(config.epsilon_start, config.epsilon_end, config.epsilon_decay)
            return lambda episode, _env_steps: schedule(episode)


class EpsilonGreedy:
    """Chooses actions in N environments (Eq. 3) and updates ε by its schedule.

    Args:
        config: the schedule.
        num_actions: A.
        rng: random generator that decides when to explore and draws random actions.
    """

    def __init__(self, config: ExplorationConfig, num_actions: int, rng: Generator) -> None:
        self._epsilon_of = make_schedule(config)
        self.epsilon = self._epsilon_of(0, 0)
        self._num_actions = num_actions
        self._rng = rng

    def schedule(self, episodes: int, env_steps: int) -> None:
        """Set ε after that many episodes have ended and that many environment steps."""
        self.epsilon = self._epsilon_of(episodes, env_steps)

    def act(self, count: int, values: Callable[[], FloatArray]) -> IntArray:
        """Choose an action in each of `count` environments, [N].

        Args:
            count: N.
            values: computes Q(s,·) in each environment, [N, A]; called only if an action is greedy.
        """
        explores = explore(self.epsilon, count, self._rng)
        num_random = np.count_nonzero(explores)
        actions = np.zeros(count, np.int64) if num_random == count else values().argmax(axis=1)
        if num_random:
            actions[explores] = self._rng.integers(self._num_actions, size=num_random)
        return actions
