import copy
from collections.abc import Callable
from itertools import islice, pairwise
from typing import Any

import gymnasium
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from stepping import act, fly, observe
from touchdown.agents import registry
from touchdown.agents.planning import read_model, value_iteration
from touchdown.agents.tabular import TabularAgent
from touchdown.config.config import Config
from touchdown.config.sections import ExplorationConfig, LearningConfig, TableConfig, TrainingConfig
from touchdown.core.errors import UserError
from touchdown.core.seeding import streams
from touchdown.core.types import Spaces, StepResult

SPACES = Spaces(observation_size=5, num_actions=2, num_states=5)
BOX = Spaces(2, 3, low=(-1.0, 0.0), high=(1.0, 4.0))
SEEN = np.eye(5, dtype=np.float32)
GREEDY = {"epsilon_start": 0.0}


def new_table(
    seed: int = 0,
    *,
    spaces: Spaces = SPACES,
    algorithm: Any = "tabular",
    exploration: dict[str, Any] | None = None,
    learning: dict[str, Any] | None = None,
    table: dict[str, Any] | None = None,
    num_envs: int = 1,
    metrics_period: int = 1,
) -> TabularAgent:
    config = Config(
        seed=seed,
        algorithm=algorithm,
        exploration=ExplorationConfig(
            **{"schedule": "constant", "epsilon_start": 0.5} | (exploration or {})
        ),
        learning=LearningConfig(**{"gamma": 0.5} | (learning or {})),
        table=TableConfig(**table or {}),
        training=TrainingConfig(metrics_period=metrics_period, num_envs=num_envs),
    )
    return TabularAgent(config, spaces, streams(seed))


def learning_by(target: str, **settings: Any) -> TabularAgent:
    return new_table(
        exploration=GREEDY, learning={"learning_rate": 0.5, "target": target}, **settings
    )


def step(agent: TabularAgent, s: int, a: int, r: float, s_t: int, **ends: Any) -> Any:
    return observe(agent, SEEN[s], a, r, SEEN[s_t], **ends)


def taught(agent: TabularAgent, steps: int, *envs: Any) -> TabularAgent:
    for _ in islice(fly(agent, *envs), steps):
        pass
    return agent


# --- learning where the answer is known ---


def test_q_learning_comes_to_the_values_of_value_iteration(chain):
    agent = taught(new_table(learning={"learning_rate": 0.5}), 3_000, chain())
    best = value_iteration(read_model(chain.transitions()), 0.5)
    assert best[4].tolist() == [2, 8]
    assert_allclose(agent.q, best, atol=1e-6)
    assert agent.policy(agent.weights()).act(SEEN).tolist() == [1] * 5


@pytest.mark.parametrize("target", ["sarsa", "expected-sarsa"])
def test_sarsa_comes_to_the_values_of_its_own_exploring_policy(target: str, chain):
    settings = {
        "target": target,
        "learning_rate": 0.5,
        "learning_rate_end": 0.005,
        "learning_rate_duration": 12_000,
    }
    agent = taught(new_table(learning=settings), 14_000, chain())
    exact = chain.values_of_acting(0.5, 0.5)
    assert exact[3, 1] < 3.7  # and 4 by the best policy
    assert_allclose(agent.q, exact, atol=0.02 if target == "expected-sarsa" else 0.1)


def test_several_environments_teach_one_table(chain):
    for target in ("q-learning", "sarsa"):
        agent = new_table(
            exploration={"schedule": "linear", "epsilon_end": 0.0, "epsilon_duration": 1_500},
            learning={"learning_rate": 0.5, "target": target},
            num_envs=3,
        )
        taught(agent, 1_000, *(chain() for _ in range(3)))
        assert agent.env_steps == 3_000
        assert agent.q[4, 1] == pytest.approx(8)
        assert agent.q.argmax(axis=1).tolist() == [1] * 5


@pytest.mark.parametrize("slippery", [False, True])
def test_value_iteration_of_the_frozen_lake_is_done_in_sweeps_of_the_agent(slippery: bool):
    transitions: Any = gymnasium.make("FrozenLake-v1", is_slippery=slippery).unwrapped
    spaces = Spaces(16, 4, 16, transitions=transitions.P)
    agent = new_table(
        spaces=spaces, algorithm="value-iteration", learning={"gamma": 0.9, "update_period": 2}
    )
    seen = np.eye(16, dtype=np.float32)
    metrics = [observe(agent, seen[0], 0, 0.0, seen[0]) for _ in range(600)]
    assert agent.updates == 300  # a sweep every second observation
    assert [entry is not None for entry in metrics] == [False, True] * 300
    assert_allclose(
        agent.q,
        value_iteration(read_model(transitions.P), 0.9),
        atol=1e-9,
    )
    assert metrics[-1]["loss"] == pytest.approx(0, abs=1e-12)
    if not slippery:
        assert agent.q[0].max() == pytest.approx(0.9**5)  # the goal's 1, six steps away


# --- one step ---


def test_q_learning_goes_towards_the_best_next_value_at_once():
    agent = learning_by("q-learning")
    agent.q[1] = 4, 8
    metrics = step(agent, 0, 1, 1.0, 1)
    assert agent.q[0].tolist() == [0, 2.5]  # ½·(1 + ½·8)
    assert metrics == {"loss": 25.0, "mean_q": 2.1, "max_q": 8.0}  # 5², (2½ + 8)/5


def test_expected_sarsa_goes_towards_the_mean_of_its_exploring_policy():
    agent = new_table(
        exploration={"epsilon_start": 0.5},
        learning={"learning_rate": 0.5, "target": "expected-sarsa"},
    )
    agent.q[1] = 4, 8
    step(agent, 0, 1, 1.0, 1)
    assert agent.q[0].tolist() == [0, 2.25]  # ½·(1 + ½·(½·8 + ½·6))


def test_sarsa_waits_for_the_action_that_comes_next():
    agent = learning_by("sarsa")
    agent.q[1] = 4, 8
    assert step(agent, 0, 1, 1.0, 1) is None
    assert agent.updates == 0
    assert not agent.q[0].any()
    assert step(agent, 1, 0, 0.0, 2) is not None
    assert agent.q[0].tolist() == [0, 1.5]  # ½·(1 + ½·4), not the better action's 8


@pytest.mark.parametrize("target", ["q-learning", "sarsa", "expected-sarsa"])
def test_a_terminated_step_does_not_bootstrap(target: str):
    agent = learning_by(target)
    agent.q[:] = 100
    agent.q[0] = 0
    step(agent, 0, 1, 6.0, 3, terminated=True)
    assert agent.q[0].tolist() == [0, 3]
    step(agent, 4, 0, 0.0, 4)  # another episode's action is nothing to the one before
    assert agent.q[0].tolist() == [0, 3]


def test_both_of_sarsas_last_steps_are_learned_when_the_episode_terminates():
    agent = learning_by("sarsa")
    agent.q[1] = 4, 8
    step(agent, 0, 1, 1.0, 1)
    step(agent, 1, 0, 6.0, 2, terminated=True)
    assert agent.updates == 2
    assert agent.q[0].tolist() == [0, 1.5]
    assert agent.q[1].tolist() == [5, 8]  # 4 + ½·(6 − 4)


@pytest.mark.parametrize("target", ["q-learning", "sarsa", "expected-sarsa"])
def test_a_truncated_episode_bootstraps_with_the_action_that_would_have_come(target: str):
    agent = learning_by(target)
    agent.q[1], agent.q[2] = (4, 8), (64, 32)
    step(agent, 0, 1, 1.0, 1, truncated=True, next_observation=SEEN[2])
    assert agent.q[0].tolist() == [0, 2.5]  # without exploring it is the best one of state 1
    step(agent, 2, 1, 0.0, 3)
    assert agent.q[0].tolist() == [0, 2.5]


def test_the_step_size_falls_in_a_line_over_the_updates():
    agent = new_table(
        learning={
            "learning_rate": 1.0,
            "learning_rate_end": 0.5,
            "learning_rate_duration": 2,
            "gamma": 0.0,
        }
    )
    for state in range(4):
        step(agent, state, 0, 8.0, state)
    assert agent.q[:, 0].tolist() == [8, 6, 4, 4, 0]


def test_a_table_starts_as_high_as_its_config_says():
    assert np.all(new_table(table={"initial_value": 3.0}).q == 3)


def test_each_environment_of_sarsa_waits_for_its_own_action():
    agent = learning_by("sarsa", num_envs=2)
    agent.q[1], agent.q[2] = (4, 8), (16, 32)
    no = np.zeros(2, bool)
    rewards = np.ones(2)
    agent.observe(
        SEEN[[0, 3]], np.array([0, 1]), StepResult(SEEN[[1, 2]], rewards, no, no), SEEN[[1, 2]]
    )
    assert agent.updates == 0
    agent.observe(
        SEEN[[1, 2]], np.array([0, 1]), StepResult(SEEN[[4, 4]], rewards, no, no), SEEN[[4, 4]]
    )
    assert agent.q[0].tolist() == [1.5, 0]  # ½·(1 + ½·4)
    assert agent.q[3].tolist() == [0, 8.5]  # ½·(1 + ½·32)


# --- what fits ---


@pytest.mark.parametrize("refusing", [TabularAgent, registry.check_fits])
def test_a_plan_needs_a_model_whatever_the_states_are(refusing: Callable[..., object]):
    config = Config(env_id="Box-v0", algorithm="value-iteration")
    arguments = (config, BOX, streams(0))[: 3 if refusing is TabularAgent else 2]
    with pytest.raises(UserError, match="env_id 'Box-v0': its model is not known; value iter"):
        refusing(*arguments)


def test_a_model_that_is_none_is_refused_in_one_line():
    config = Config(env_id="Odd-v0", algorithm="value-iteration")
    odd = SPACES._replace(transitions={0: {0: [(0.5, 0, 0.0, False)]}})
    with pytest.raises(UserError) as refused:
        registry.check_fits(config, odd)
    assert str(refused.value) == (
        "env_id 'Odd-v0': its model cannot be read: state 0, action 0: probabilities sum to 0.5"
    )


def test_a_network_fits_every_environment():
    registry.check_fits(Config(), BOX)
    registry.check_fits(Config(algorithm="pqn"), SPACES)


# --- what is kept ---


@pytest.mark.parametrize("target", ["q-learning", "sarsa", "expected-sarsa"])
def test_a_restored_agent_goes_on_as_if_nothing_had_happened(target: str, chain):
    settings = {
        "learning": {
            "target": target,
            "learning_rate": 0.5,
            "learning_rate_end": 0.1,
            "learning_rate_duration": 300,
        },
        "exploration": {"schedule": "linear", "epsilon_start": 1.0, "epsilon_duration": 300},
    }
    agent = taught(new_table(**settings), 100, chain())
    o_tm1, o_t = SEEN[1], SEEN[2]
    observe(agent, o_tm1, 0, 0.25, o_t)  # a step that SARSA waits with
    resumed = new_table(**settings)
    resumed.restore(copy.deepcopy(agent.state()))
    generator = agent._actor._explorer._rng.bit_generator
    resumed._actor._explorer._rng.bit_generator.state = generator.state
    for before, after in pairwise(np.random.default_rng(1).integers(5, size=200)):
        actions = [act(it, SEEN[before]) for it in (agent, resumed)]
        assert actions[0] == actions[1]
        for it in (agent, resumed):
            step(it, before, actions[0], 1.0, after)
    assert_array_equal(agent.q, resumed.q)
    assert agent.epsilon == resumed.epsilon
    assert agent._pending == resumed._pending


def test_what_is_handed_out_does_not_change_as_learning_goes_on():
    agent = learning_by("q-learning")
    weights = agent.weights()
    policy = agent.policy(weights)
    step(agent, 0, 1, 1.0, 1)
    assert not weights["q"].any()
    assert policy.act(SEEN[:1]).tolist() == [0]
    assert agent.policy(agent.weights()).act(SEEN[:1]).tolist() == [1]


def test_one_seed_repeats_and_another_differs(chain):
    tables = [taught(new_table(seed), 200, chain()).q for seed in (3, 3, 4)]
    assert_array_equal(tables[0], tables[1])
    assert not np.array_equal(tables[0], tables[2])


def test_metrics_come_once_a_period_of_updates(chain):
    agent = new_table(num_envs=4, metrics_period=6)
    steps = islice(fly(agent, *(chain() for _ in range(4))), 6)
    # after 4, 8, 12, 16, 20 and 24 updates
    assert [agent_step.metrics is not None for agent_step in steps] == [
        False, True, True, False, True, True
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("pending", "said"),
    [
        ([], "0 pending steps for other environments"),
        ([(9, 0, 1.0, 1)], r"pending = \(9, 0, 1.0, 1\): must be of 5 states"),
        ([(0, 2, 1.0, 1)], r"pending = \(0, 2, 1.0, 1\): must be of 5 states"),
        ([(0, 0, 1.0)], "agent.pending: "),
        ("x", "agent.pending: "),
    ],
)
def test_pending_steps_of_another_environment_are_refused(pending, said):
    agent = learning_by("sarsa")
    with pytest.raises(ValueError, match=said):
        agent.restore(agent.state() | {"pending": pending})
