"""The current episodes of a pool of environments, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from touchdown.core.types import FloatArray, IntArray, StepResult

_ROOM = 1_024  # initial capacity for actions; most environments truncate episodes earlier


@dataclass(slots=True)
class Episode:
    """One episode, in progress or just ended."""

    number: int
    observation: FloatArray
    """The latest observation, [D]."""
    actions: list[int] = field(default_factory=list[int])
    """Actions since its start."""
    episode_return: float = 0.0


class Underway:
    """The current episodes of N environments, as arrays, so that one call records a complete step.

    Args:
        episodes: one per environment, at its start or resumed.
    """

    def __init__(self, episodes: Sequence[Episode]) -> None:
        self.observations = np.stack([episode.observation for episode in episodes])
        """The latest observation of each environment, [N, D]."""
        self.numbers = np.array([episode.number for episode in episodes])
        """Number of the episode in each environment, [N]."""
        self.steps = np.array([len(episode.actions) for episode in episodes])
        """Steps taken in each episode, [N]."""
        self.returns = np.array([episode.episode_return for episode in episodes])
        """Sum of the rewards in each episode, [N]."""
        room = max(_ROOM, 2 * int(self.steps.max()))
        self.actions = np.zeros((len(episodes), room), np.int32)
        """Actions since the start of each episode, [N, room]; as many as its steps are valid."""
        for index, episode in enumerate(episodes):
            self.actions[index, : len(episode.actions)] = episode.actions

    def add(self, indices: IntArray, actions: IntArray, steps: StepResult) -> None:
        """Record one step of some of the environments, in the order of `indices`."""
        if self.steps.max() == self.actions.shape[1]:
            self.actions = np.concatenate([self.actions, np.zeros_like(self.actions)], axis=1)
        self.observations[indices] = steps.observations
        self.actions[indices, self.steps[indices]] = actions
        self.returns[indices] += steps.rewards
        self.steps[indices] += 1

    def begin(self, index: int, number: int, observation: FloatArray) -> None:
        """Start a new episode in one environment."""
        self.observations[index] = observation
        self.numbers[index] = number
        self.steps[index] = 0
        self.returns[index] = 0.0

    def episode(self, index: int) -> Episode:
        """A copy of the current episode in one environment."""
        actions = self.actions[index, : self.steps[index]].tolist()
        observation = self.observations[index].copy()
        return Episode(int(self.numbers[index]), observation, actions, float(self.returns[index]))

    def episodes(self) -> list[Episode]:
        """Copies of the current episodes in all environments."""
        return [self.episode(index) for index in range(len(self.numbers))]
