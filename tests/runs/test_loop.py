from collections.abc import Callable
from itertools import islice
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from touchdown.agents.dqn import DQNAgent
from touchdown.runs.loop import Step, interact

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


def learnt_values(agent: DQNAgent) -> np.ndarray:
    """Q(s,·) of each one-hot state."""
    return np.asarray(agent.network.values(agent.state.online_params, np.eye(5, dtype=np.float32)))


def taught(agent: DQNAgent, env: Any, steps: int) -> DQNAgent:
    for _ in islice(interact(agent, env, lambda episode: episode), steps):
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
    assert not np.allclose(learnt_values(agent), value_iteration(chain), atol=1)
    taught(agent, chain(), 3_000)
    scale = learning.get("reward_scale", 1.0)
    assert_allclose(learnt_values(agent) / scale, value_iteration(chain), atol=0.05)
    assert agent.pilot().act(np.eye(5, dtype=np.float32)).tolist() == [1] * 5


class Cut:
    """Pays 1 a step, and ends after every second step: the world does, or the time."""

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
        (False, [2.0, 2.0]),  # 1/(1 − ½): time's limit is no end of the world
        (True, [1.5, 1.0]),  # 1 + ½·1, and 1
    ],
)
def test_a_world_that_is_only_ever_truncated_is_worth_its_reward_forever(
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
    assert_allclose(learnt_values(agent)[:2].max(axis=1), values, atol=0.01)


# --- the loop itself ---


class Script:
    """An agent that only listens, and always goes right."""

    def __init__(self) -> None:
        self.heard: list[Any] = []

    def begin_episode(self, episode: int) -> None:
        self.heard.append(("episode", episode))

    def act(self, observation: np.ndarray) -> int:
        self.heard.append(("act", int(observation.argmax())))
        return 1

    def cut(self) -> None:
        self.heard.append(("cut",))

    def observe(self, o_tm1, a_tm1, r_t, o_t, *, terminated: bool) -> str:
        self.heard.append((int(o_tm1.argmax()), a_tm1, r_t, int(o_t.argmax()), terminated))
        return f"metrics {len(self.heard)}"


def test_the_loop_tells_the_agent_all_that_happens_in_order(chain):
    agent = Script()
    starts = {7: 3, 8: 1, 9: 2}
    steps = list(islice(interact(agent, chain(limit=2), starts.__getitem__, 7), 5))
    assert agent.heard == [
        ("episode", 7),
        ("act", 3),
        (3, 1, 0.0, 4, False),
        ("act", 4),
        (4, 1, 8.0, 4, True),
        ("episode", 8),
        ("act", 1),
        (1, 1, 0.0, 2, False),
        ("act", 2),
        (2, 1, 0.0, 3, False),  # truncated here, and not terminated
        ("cut",),
        ("episode", 9),
        ("act", 2),
        (2, 1, 0.0, 3, False),
    ]
    assert {step.action for step in steps} == {1}
    assert [(step.episode, *step[2:5]) for step in steps] == [
        (7, 0.0, False, False),
        (7, 8.0, True, False),
        (8, 0.0, False, False),
        (8, 0.0, False, True),
        (9, 0.0, False, False),
    ]
    assert [int(step.o_t.argmax()) for step in steps] == [4, 4, 2, 3, 3]
    assert [step.metrics for step in steps] == [f"metrics {n}" for n in (3, 5, 8, 10, 14)]
    assert all(isinstance(step, Step) for step in steps)


def test_the_loop_does_nothing_before_it_is_asked_for_a_step(chain):
    agent = Script()
    loop = interact(agent, chain(), lambda episode: episode)
    assert agent.heard == []
    next(loop)
    assert agent.heard == [("episode", 0), ("act", 0), (0, 1, 0.0, 1, False)]
