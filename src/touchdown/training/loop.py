"""The interaction loop of agent and environments, as a generator of steps."""

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.core.types import IntArray, StepResult
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.pool import EnvPool


class AgentStep(NamedTuple):
    """One step of all environments, with the agent's actions and metrics."""

    actions: IntArray
    """[N]"""
    result: StepResult
    epsilon: float
    """Probability of a random action when the actions were chosen; 0 of an agent without one."""
    ended: list[Episode]
    """Episodes that ended in this step, in the order of their environments."""
    metrics: Mapping[str, float] | None
    """Metrics of an update, once per metrics period."""


def begin(pool: EnvPool, start_of: Callable[[int], int], num_envs: int) -> Underway:
    """Start the first episode of each environment.

    Args:
        pool: the environments.
        start_of: the environment seed of an episode, by its number.
        num_envs: N.
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
    """The two loops of Algorithm 2, endless: the caller reads the steps and stops when it wants.

    Args:
        agent: acts and learns.
        pool: the environments.
        start_of: the environment seed of an episode, by its number.
        underway: the current episode in each environment, updated before each step is yielded.
    """
    numbers = underway.numbers
    every_env = np.arange(len(numbers))
    while True:
        epsilon = float(getattr(agent, "epsilon", 0.0))
        # copies, because the agent may keep them and the arrays are overwritten in each step
        observations = underway.observations.copy()
        actions = agent.act(observations)
        result = pool.step(every_env, actions)
        underway.add(every_env, actions, result)
        over = np.flatnonzero(result.ended).tolist()
        ended = [underway.episode(index) for index in over]
        for index in over:
            number = int(numbers.max()) + 1
            underway.begin(index, number, pool.reset(index, start_of(number)))
        metrics = agent.observe(observations, actions, result, underway.observations.copy())
        yield AgentStep(actions, result, epsilon, ended, metrics)
