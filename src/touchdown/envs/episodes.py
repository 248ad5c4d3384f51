"""Episodes under way in several environments, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from touchdown.core.types import FloatArray, IntArray, StepResult

_ROOM = 1_024  # actions of an episode at first; most worlds cut theirs off before


@dataclass(slots=True)
class Episode:
    """One episode under way, or just ended."""

    number: int
    observation: FloatArray
    """The latest, [D]."""
    actions: list[int] = field(default_factory=list[int])
    """Taken since its start."""
    episode_return: float = 0.0


class Underway:
    """The episodes under way in N worlds, as arrays: a step of many is written down at once.

    Args:
        episodes: one a world, as they begin or go on.
    """

    def __init__(self, episodes: Sequence[Episode]) -> None:
        self.observations = np.stack([episode.observation for episode in episodes])
        """The latest, [N, D]."""
        self.numbers = np.array([episode.number for episode in episodes])
        """Of the episodes, [N]."""
        self.steps = np.array([len(episode.actions) for episode in episodes])
        """Taken since their starts, [N]."""
        self._returns = np.array([episode.episode_return for episode in episodes])
        room = max(_ROOM, 2 * int(self.steps.max()))
        self._actions = np.zeros((len(episodes), room), np.int32)
        for index, episode in enumerate(episodes):
            self._actions[index, : len(episode.actions)] = episode.actions

    def add(self, indices: IntArray, actions: IntArray, steps: StepResult) -> None:
        """One step of some of the worlds, in the order of `slots`."""
        if self.steps.max() == self._actions.shape[1]:
            self._actions = np.concatenate([self._actions, np.zeros_like(self._actions)], axis=1)
        self.observations[indices] = steps.observations
        self._actions[indices, self.steps[indices]] = actions
        self._returns[indices] += steps.rewards
        self.steps[indices] += 1

    def begin(self, index: int, number: int, observation: FloatArray) -> None:
        """Another episode in one world."""
        self.observations[index] = observation
        self.numbers[index] = number
        self.steps[index] = 0
        self._returns[index] = 0.0

    def episode(self, index: int) -> Episode:
        """The episode in one world, as it is now."""
        actions = self._actions[index, : self.steps[index]].tolist()
        observation = self.observations[index].copy()
        return Episode(int(self.numbers[index]), observation, actions, float(self._returns[index]))

    def episodes(self) -> list[Episode]:
        """Those of all worlds."""
        return [self.episode(index) for index in range(len(self.numbers))]
