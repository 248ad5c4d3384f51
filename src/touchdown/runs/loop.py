"""The loop of agent and world, as a generator of steps."""

from collections.abc import Callable, Iterator
from itertools import count
from typing import NamedTuple

from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learner import Metrics
from touchdown.lander.env import Env
from touchdown.types import FloatArray


class Step(NamedTuple):
    """One step of the world and what the agent made of it."""

    episode: int
    action: int
    reward: float
    terminated: bool
    truncated: bool
    o_t: FloatArray
    metrics: Metrics | None


def interact(
    agent: DQNAgent,
    env: Env,
    start_of: Callable[[int], int],
    first_episode: int = 0,
    underway: FloatArray | None = None,
) -> Iterator[Step]:
    """Algorithm 2's two loops, without end: whoever wants to know listens to the steps.

    Args:
        agent: acts, remembers and learns.
        env: with the Gymnasium interface.
        start_of: the environment seed of an episode.
        first_episode: number of the first episode flown.
        underway: the latest observation, if that episode has begun already.
    """
    for episode in count(first_episode):
        if underway is None:
            observation, _ = env.reset(seed=start_of(episode))
            agent.begin_episode(episode)
        else:
            observation, underway = underway, None
        ended = False
        while not ended:
            action = agent.act(observation)
            o_t, reward, terminated, truncated, _ = env.step(action)
            metrics = agent.observe(
                observation, action, float(reward), o_t, terminated=bool(terminated)
            )
            observation = o_t
            ended = terminated or truncated
            if truncated and not terminated:
                agent.cut()
            ends = bool(terminated), bool(truncated)
            yield Step(episode, action, float(reward), *ends, o_t, metrics)
