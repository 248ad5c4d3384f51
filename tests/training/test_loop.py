from collections.abc import Callable
from itertools import islice
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from stepping import SPACES, fly
from touchdown.agents.dqn import DQNAgent
from touchdown.core.types import StepResult
from touchdown.envs.environment import MadeEnv
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.pool import StockEnvPool
from touchdown.training.loop import AgentStep, interact

NewAgent = Callable[..., DQNAgent]

GAMMA = 0.5
OPTIMAL = [  # the goal's 8, halved a step: left is a detour of two steps, or the wall and its bait
    [0.35, 0.5],
    [0.25, 1],
    [0.5, 2],
    [1, 4],
    [2, 8],
]


def value_iteration(chain) -> np.ndarray:
    """Q* of the chain from its model, by sweeping Bellman's optimality equation."""
    q = np.zeros((chain.STATES, 2))
    for _ in range(60):
        for state in range(chain.STATES):
            for action in (0, 1):
                reward, after = chain.model(state, action)
                q[state, action] = reward + (0 if after is None else GAMMA * q[after].max())
    return q


def learned_values(agent: DQNAgent) -> np.ndarray:
    """Q(s,·) of each one-hot state."""
    return agent.learner.values(np.eye(5, dtype=np.float32), 0)


def taught(agent: DQNAgent, env: Any, steps: int) -> DQNAgent:
    for _ in islice(fly(agent, env), steps):
        pass
    return agent


# --- learning where the answer is known ---


def test_value_iteration_finds_that_right_is_best_everywhere(chain):
    assert_allclose(value_iteration(chain), OPTIMAL, atol=1e-12)


@pytest.mark.parametrize(
    ("replay", "learning"),
    [
        ({}, {}),
        ({}, {"target_period": 50}),
        ({"resaves": 3}, {"target_period": 50}),
        ({}, {"loss": "huber", "reward_scale": 0.5, "target_period": 50}),
    ],
    ids=["dqn", "target", "resaves", "scaled huber"],
)
def test_on_a_chain_of_five_states_the_agent_learns_the_values_of_value_iteration(
    replay: dict[str, Any], learning: dict[str, Any], new_agent: NewAgent, chain
):
    agent = new_agent(
        replay=replay,
        exploration={"schedule": "constant", "epsilon_start": 0.5},
        learning={
            "gamma": GAMMA,
            "learning_rate": 0.01,
            "learning_rate_end": 1e-4,
            "learning_rate_duration": 2_500,
        }
        | learning,
    )
    assert not np.allclose(learned_values(agent), value_iteration(chain), atol=1)
    taught(agent, chain(), 3_000)
    scale = learning.get("reward_scale", 1.0)
    assert_allclose(learned_values(agent) / scale, value_iteration(chain), atol=0.05)
    assert agent.policy(agent.weights()).act(np.eye(5, dtype=np.float32)).tolist() == [1] * 5


class Cut:
    """Pays 1 a step; every second step terminates or truncates the episode."""

    def __init__(self, *, terminated: bool) -> None:
        self.terminated = terminated

    def reset(self, *, seed: int) -> tuple[np.ndarray, dict[str, Any]]:
        del seed
        self.steps = 0
        return np.eye(5, dtype=np.float32)[0], {}

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        del action
        self.steps += 1
        ended = self.steps == 2
        observation = np.eye(5, dtype=np.float32)[self.steps % 2]
        return observation, 1.0, ended and self.terminated, ended and not self.terminated, {}


@pytest.mark.parametrize(
    ("terminated", "values"),
    [
        (False, [2.0, 2.0]),  # 1/(1 − ½): a time limit does not terminate
        (True, [1.5, 1.0]),  # 1 + ½·1, and 1
    ],
)
def test_an_environment_that_only_truncates_is_worth_its_reward_forever(
    terminated: bool, values: list[float], new_agent: NewAgent
):
    agent = new_agent(
        exploration={"schedule": "constant", "epsilon_start": 1.0},
        learning={
            "gamma": GAMMA,
            "learning_rate": 0.01,
            "learning_rate_end": 1e-4,
            "learning_rate_duration": 800,
        },
    )
    taught(agent, Cut(terminated=terminated), 1_000)
    assert_allclose(learned_values(agent)[:2].max(axis=1), values, atol=0.01)


# --- the loop itself ---


class Script:
    """An agent that only listens, and always goes right."""

    epsilon = 0.5

    def __init__(self) -> None:
        self.heard: list[Any] = []

    def act(self, observations: np.ndarray) -> np.ndarray:
        self.heard.append(("act", *observations.argmax(axis=1).tolist()))
        return np.ones(len(observations), int)

    def observe(self, o_tm1, a_tm1, steps, following) -> dict[str, float]:
        self.heard.append(
            (
                *o_tm1.argmax(axis=1).tolist(),
                *a_tm1.tolist(),
                *steps.rewards.tolist(),
                *steps.observations.argmax(axis=1).tolist(),
                *steps.terminated.tolist(),
                *steps.truncated.tolist(),
                *following.argmax(axis=1).tolist(),
            )
        )
        self.epsilon /= 2 ** np.count_nonzero(steps.ended)
        return {"heard": len(self.heard)}


def begun(env: Any, starts: dict[int, int], number: int) -> Underway:
    return Underway([Episode(number, env.reset(seed=starts[number])[0])])


def test_the_loop_tells_the_agent_all_that_happens_in_order(chain):
    agent, env = Script(), chain(limit=2)
    starts = {7: 3, 8: 1, 9: 2}
    loop = interact(
        agent, StockEnvPool([MadeEnv(env, SPACES)]), starts.__getitem__, begun(env, starts, 7)
    )
    steps = list(islice(loop, 5))
    assert agent.heard == [
        ("act", 3),
        (3, 1, 0.0, 4, False, False, 4),
        ("act", 4),
        (4, 1, 8.0, 4, True, False, 1),
        ("act", 1),
        (1, 1, 0.0, 2, False, False, 2),
        ("act", 2),
        (2, 1, 0.0, 3, False, True, 2),
        ("act", 2),
        (2, 1, 0.0, 3, False, False, 3),
    ]
    assert [step.epsilon for step in steps] == [0.5, 0.5, 0.25, 0.25, 0.125]
    assert [
        [(e.number, e.episode_return, len(e.actions)) for e in step.ended] for step in steps
    ] == [
        [],
        [(7, 8.0, 2)],
        [],
        [(8, 0.0, 2)],
        [],
    ]
    assert [int(step.result.observations.argmax()) for step in steps] == [4, 4, 2, 3, 3]
    assert [step.metrics for step in steps] == [{"heard": n} for n in (2, 4, 6, 8, 10)]
    assert all(isinstance(step, AgentStep) for step in steps)


def test_each_environment_begins_its_next_episode_when_one_ends(chain):
    agent = Script()
    steps = list(
        islice(fly(agent, chain(), chain(), chain(), start_of=(4, 3, 2, 1, 0, 3).__getitem__), 3)
    )
    ended = [[(e.number, e.actions, e.episode_return) for e in step.ended] for step in steps]
    assert ended == [[(0, [1], 8.0)], [(1, [1, 1], 8.0)], [(2, [1, 1, 1], 8.0)]]
    acted_on = [heard[1:] for heard in agent.heard if heard[0] == "act"]
    assert acted_on == [(4, 3, 2), (1, 4, 3), (2, 0, 4)]


def test_the_loop_does_nothing_before_it_is_asked_for_a_step(chain):
    agent, env = Script(), chain()
    loop = interact(agent, StockEnvPool([MadeEnv(env, SPACES)]), int, begun(env, {0: 0}, 0))
    assert agent.heard == []
    next(loop)
    assert agent.heard == [("act", 0), (0, 1, 0.0, 1, False, False, 1)]


def test_episodes_under_way_are_kept_as_they_would_be_one_by_one():
    rng = np.random.default_rng(0)
    begun = [Episode(n, rng.random(3), list(range(n)), 0.1 * n) for n in range(4)]
    underway = Underway(begun)
    plain = [Episode(e.number, e.observation, list(e.actions), e.episode_return) for e in begun]
    for step in range(2_500):  # more than there is room for at first
        indices = np.flatnonzero(rng.random(4) < 0.7)
        actions, rewards = rng.integers(9, size=len(indices)), rng.normal(size=len(indices))
        over = np.zeros(len(indices), bool)
        steps = StepResult(rng.random((len(indices), 3)), rewards, over, over)
        underway.add(indices, actions, steps)
        for row, index in enumerate(indices.tolist()):
            plain[index].observation = steps.observations[row]
            plain[index].actions.append(int(actions[row]))
            plain[index].episode_return += float(rewards[row])
        if step % 100 == 0:
            plain[2] = Episode(10 + step, rng.random(3))
            underway.begin(2, plain[2].number, plain[2].observation)
    for index, (kept, wanted) in enumerate(zip(underway.episodes(), plain, strict=True)):
        assert kept.number == wanted.number
        assert kept.observation.tolist() == wanted.observation.tolist()
        assert kept.actions == wanted.actions
        assert kept.episode_return == wanted.episode_return
        assert underway.steps[index] == len(wanted.actions)


def test_an_episode_that_was_handed_out_stays_as_it_was():
    underway = Underway([Episode(0, np.zeros(2))])
    episode = underway.episode(0)
    over = np.zeros(1, bool)
    underway.add(np.arange(1), np.ones(1, int), StepResult(np.ones((1, 2)), np.ones(1), over, over))
    assert episode == Episode(0, episode.observation, [], 0.0)
    assert episode.observation.tolist() == [0.0, 0.0]
