"""The loop of agent and worlds, as a generator of steps."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.lander.slots import Slots
from touchdown.types import FloatArray, IntArray, Steps

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
        for slot, episode in enumerate(episodes):
            self._actions[slot, : len(episode.actions)] = episode.actions

    def add(self, slots: IntArray, actions: IntArray, steps: Steps) -> None:
        """One step of some of the worlds, in the order of `slots`."""
        if self.steps.max() == self._actions.shape[1]:
            self._actions = np.concatenate([self._actions, np.zeros_like(self._actions)], axis=1)
        self.observations[slots] = steps.observations
        self._actions[slots, self.steps[slots]] = actions
        self._returns[slots] += steps.rewards
        self.steps[slots] += 1

    def begin(self, slot: int, number: int, observation: FloatArray) -> None:
        """Another episode in one world."""
        self.observations[slot] = observation
        self.numbers[slot] = number
        self.steps[slot] = 0
        self._returns[slot] = 0.0

    def episode(self, slot: int) -> Episode:
        """The episode in one world, as it is now."""
        actions = self._actions[slot, : self.steps[slot]].tolist()
        observation = self.observations[slot].copy()
        return Episode(int(self.numbers[slot]), observation, actions, float(self._returns[slot]))

    def episodes(self) -> list[Episode]:
        """Those of all worlds."""
        return [self.episode(slot) for slot in range(len(self.numbers))]


class Moment(NamedTuple):
    """One step of all worlds and what the agent made of it."""

    actions: IntArray
    """[N]"""
    steps: Steps
    epsilon: float
    """That the actions were chosen with."""
    ended: list[Episode]
    """Episodes that ended, in the order of their worlds."""
    metrics: dict[str, float] | None


def begin(slots: Slots, start_of: Callable[[int], int], num_envs: int) -> Underway:
    """The first episode of each world.

    Args:
        slots: the worlds.
        start_of: the environment seed of an episode.
        num_envs: how many.
    """
    return Underway([Episode(slot, slots.reset(slot, start_of(slot))) for slot in range(num_envs)])


def interact(
    agent: Agent,
    slots: Slots,
    start_of: Callable[[int], int],
    underway: Underway,
) -> Iterator[Moment]:
    """Algorithm 2's two loops, without end: whoever wants to know listens to the steps.

    Args:
        agent: acts, remembers and learns.
        slots: worlds side by side.
        start_of: the environment seed of an episode.
        underway: the episode in each world; kept up to date between two steps.
    """
    numbers = underway.numbers
    everyone = np.arange(len(numbers))
    while True:
        epsilon = agent.epsilon
        # the agent may keep what it is shown, and steps are written over the other
        observations = underway.observations.copy()
        actions = agent.act(observations)
        steps = slots.step(everyone, actions)
        underway.add(everyone, actions, steps)
        over = np.flatnonzero(steps.ended).tolist()
        ended = [underway.episode(slot) for slot in over]
        for slot in over:
            number = int(numbers.max()) + 1
            underway.begin(slot, number, slots.reset(slot, start_of(number)))
        metrics = agent.observe(observations, actions, steps, underway.observations.copy())
        for slot in over:
            agent.begin_episode(int(numbers[slot]) - len(numbers) + 1)
        yield Moment(actions, steps, epsilon, ended, metrics)
