"""The interaction loop of agent and environments, as a generator of steps."""

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.core.types import IntArray, StepResult
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.pool import EnvPool

STEPS_BETWEEN_LOOKS = 50
"""Steps of an episode after which a caller may look whether it should stop."""


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
    num_steps: int = 1
    """Steps since the previous `AgentStep`: this one, and those before it that ended no episode and
    have no metrics."""


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


def begin_next(
    pool: EnvPool, start_of: Callable[[int], int], underway: Underway, result: StepResult
) -> list[Episode]:
    """Start the next episode in each environment whose episode ended.

    Args:
        pool: the environments.
        start_of: the environment seed of an episode, by its number.
        underway: the current episodes, after `result` was recorded.
        result: the latest step of all environments.

    Returns:
        The episodes that ended, in the order of their environments.
    """
    over = np.flatnonzero(result.ended).tolist()
    ended = [underway.episode(index) for index in over]
    for index in over:
        number = int(underway.numbers.max()) + 1
        underway.begin(index, number, pool.reset(index, start_of(number)))
    return ended


def interact(
    agent: Agent,
    pool: EnvPool,
    start_of: Callable[[int], int],
    underway: Underway,
    *,
    bootstrap_on_time_limit: bool = True,
) -> Iterator[AgentStep]:
    """The two loops of Algorithm 2, endless: the caller reads the steps and stops when it wants.

    Args:
        agent: acts and learns.
        pool: the environments.
        start_of: the environment seed of an episode, by its number.
        underway: the current episode in each environment, updated before each step is yielded.
        bootstrap_on_time_limit: if False, the agent sees a truncated episode as terminated.
    """
    every_env = np.arange(len(underway.numbers))
    while True:
        epsilon = float(getattr(agent, "epsilon", 0.0))
        # copies, because the agent may keep them and the arrays are overwritten in each step
        observations = underway.observations.copy()
        actions = agent.act(observations)
        result = pool.step(every_env, actions)
        underway.add(every_env, actions, result)
        ended = begin_next(pool, start_of, underway, result)
        told = result if bootstrap_on_time_limit else result._replace(terminated=result.ended)
        metrics = agent.observe(observations, actions, told, underway.observations.copy())
        yield AgentStep(actions, result, epsilon, ended, metrics)
