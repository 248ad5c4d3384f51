"""The loop of agent and worlds, as a generator of steps."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.core.types import IntArray, StepResult
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.pool import EnvPool


class AgentStep(NamedTuple):
    """One step of all worlds and what the agent made of it."""

    actions: IntArray
    """[N]"""
    steps: StepResult
    epsilon: float
    """That the actions were chosen with."""
    ended: list[Episode]
    """Episodes that ended, in the order of their worlds."""
    metrics: dict[str, float] | None


def begin(pool: EnvPool, start_of: Callable[[int], int], num_envs: int) -> Underway:
    """The first episode of each world.

    Args:
        pool: the environments.
        start_of: the environment seed of an episode.
        num_envs: how many.
    """
    return Underway(
        [Episode(index, pool.reset(index, start_of(index))) for index in range(num_envs)]
    )


def interact(
    agent: Agent,
    pool: EnvPool,
    start_of: Callable[[int], int],
    underway: Underway,
) -> Iterator[AgentStep]:
    """Algorithm 2's two loops, without end: whoever wants to know listens to the steps.

    Args:
        agent: acts, remembers and learns.
        pool: the environments.
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
        steps = pool.step(everyone, actions)
        underway.add(everyone, actions, steps)
        over = np.flatnonzero(steps.ended).tolist()
        ended = [underway.episode(index) for index in over]
        for index in over:
            number = int(numbers.max()) + 1
            underway.begin(index, number, pool.reset(index, start_of(number)))
        metrics = agent.observe(observations, actions, steps, underway.observations.copy())
        for index in over:
            agent.begin_episode(int(numbers[index]) - len(numbers) + 1)
        yield AgentStep(actions, steps, epsilon, ended, metrics)
