"""The loop of agent and worlds, as a generator of steps."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.lander.slots import Slots
from touchdown.types import FloatArray, IntArray, Steps


@dataclass(slots=True)
class Episode:
    """One episode under way, or just ended."""

    number: int
    observation: FloatArray
    """The latest, [D]."""
    actions: list[int] = field(default_factory=list[int])
    """Taken since its start."""
    episode_return: float = 0.0


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


def begin(slots: Slots, start_of: Callable[[int], int], num_envs: int) -> list[Episode]:
    """The first episode of each world.

    Args:
        slots: the worlds.
        start_of: the environment seed of an episode.
        num_envs: how many.
    """
    return [Episode(slot, slots.reset(slot, start_of(slot))) for slot in range(num_envs)]


def interact(
    agent: Agent,
    slots: Slots,
    start_of: Callable[[int], int],
    episodes: list[Episode],
) -> Iterator[Moment]:
    """Algorithm 2's two loops, without end: whoever wants to know listens to the steps.

    Args:
        agent: acts, remembers and learns.
        slots: worlds side by side.
        start_of: the environment seed of an episode.
        episodes: what is under way in each world, [N]; kept up to date between two steps.
    """
    everyone = range(len(episodes))
    observations = np.stack([episode.observation for episode in episodes])
    while True:
        epsilon = agent.epsilon
        actions = agent.act(observations)
        steps = slots.step(everyone, actions)
        for slot, (action, reward) in enumerate(
            zip(actions.tolist(), steps.rewards.tolist(), strict=True)
        ):
            episode = episodes[slot]
            episode.observation = steps.observations[slot]
            episode.actions.append(action)
            episode.episode_return += reward
        following = steps.observations
        ended: list[Episode] = []
        over = np.flatnonzero(steps.ended).tolist()
        if over:
            following = following.copy()
        for slot in over:
            ended.append(episodes[slot])
            number = max(episode.number for episode in episodes) + 1
            following[slot] = slots.reset(slot, start_of(number))
            episodes[slot] = Episode(number, following[slot])
        metrics = agent.observe(observations, actions, steps, following)
        for slot in over:
            agent.begin_episode(episodes[slot].number - len(episodes) + 1)
        observations = following
        yield Moment(actions, steps, epsilon, ended, metrics)
