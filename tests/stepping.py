"""Short forms for tests of agents that act in many environments, and a policy for any test."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.core.types import Spaces, StepResult
from touchdown.envs.environment import MadeEnv
from touchdown.envs.pool import StockEnvPool
from touchdown.training.loop import AgentStep, begin, interact

SPACES = Spaces(observation_size=5, num_actions=2)  # of the chain


def observe(
    agent: Agent,
    o_tm1: np.ndarray,
    a_tm1: int,
    r_t: float,
    o_t: np.ndarray,
    *,
    terminated: bool = False,
    truncated: bool = False,
    next_observation: np.ndarray | None = None,
) -> Mapping[str, float] | None:
    steps = StepResult(o_t[None], np.array([r_t]), np.array([terminated]), np.array([truncated]))
    then = o_t if next_observation is None else next_observation
    return agent.observe(o_tm1[None], np.array([a_tm1]), steps, then[None])


def act(agent: Agent, observation: np.ndarray) -> int:
    return int(agent.act(observation[None])[0])


def fly(agent: Agent, *envs: Any, start_of: Callable[[int], int] = int) -> Iterator[AgentStep]:
    """The loop over these environments from their first episodes on."""
    pool = StockEnvPool([MadeEnv(env, SPACES) for env in envs])
    return interact(agent, pool, start_of, begin(pool, start_of, len(envs)))


class Always:
    """A policy with one action, whatever it observes."""

    def __init__(self, action: int) -> None:
        self.action = action

    def act(self, observations: np.ndarray) -> np.ndarray:
        return np.full(len(observations), self.action)
