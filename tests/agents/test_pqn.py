import copy
from itertools import islice, pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from stepping import fly
from touchdown.agents.learners.factory import make_learner
from touchdown.agents.planning import read_model, value_iteration
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.rollout import Rollout
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    RolloutConfig,
    TrainingConfig,
)
from touchdown.core.errors import UserError
from touchdown.core.seeding import streams
from touchdown.core.types import Mirror, Spaces, StepResult

# the first two numbers of an observation swap, the third changes sign; the actions swap
MIRROR = Mirror(order=(1, 0, 2, 3, 4), signs=(1.0, 1.0, -1.0, 1.0, 1.0), actions=(1, 0))
SPACES = Spaces(observation_size=5, num_actions=2, mirror=MIRROR)
NUM_ENVS = 4
SEEN = np.eye(5, dtype=np.float32)


def new_pqn(
    seed: int = 0,
    *,
    learning: dict[str, Any] | None = None,
    rollout: dict[str, Any] | None = None,
    metrics_period: int = 1,
) -> PQNAgent:
    config = Config(
        seed=seed,
        algorithm="pqn",
        network=NetworkConfig(hidden_sizes=(16, 16), layer_norm=True),
        exploration=ExplorationConfig(schedule="constant", epsilon_start=0.5),
        learning=LearningConfig(**{"gamma": 0.5, "learning_rate": 0.01} | (learning or {})),
        rollout=RolloutConfig(
            **{"rollout_steps": 8, "epochs": 2, "minibatches": 2, "trace_decay": 0.5}
            | (rollout or {})
        ),
        training=TrainingConfig(num_envs=NUM_ENVS, metrics_period=metrics_period),
    )
    return PQNAgent(config, SPACES, streams(seed), make_learner(config, SPACES))


def online(agent: PQNAgent) -> np.ndarray:
    return np.array(agent.learner.state.online_params)


def taught(agent: PQNAgent, steps: int, chain, limit: int = 20) -> PQNAgent:
    for _ in islice(fly(agent, *(chain(limit) for _ in range(NUM_ENVS))), steps):
        pass
    return agent


def random_rows(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(count, NUM_ENVS, 5)).astype(np.float32)


def feed(agent: PQNAgent, rows: np.ndarray) -> list[bytes]:
    """Random steps; gives the actions that the agent chose for them."""
    no = np.zeros(NUM_ENVS, bool)
    acted = []
    for o_tm1, o_t in pairwise(rows):
        actions = agent.act(o_tm1)
        acted.append(actions.tobytes())
        agent.observe(o_tm1, actions, StepResult(o_t, o_t[:, 0], no, no), o_t)
    return acted


def test_without_looking_further_it_learns_the_values_of_value_iteration(chain):
    agent = new_pqn(
        learning={"learning_rate_end": 1e-4, "learning_rate_duration": 600},
        rollout={"trace_decay": 0.0},
    )
    taught(agent, 1_200, chain)
    best = value_iteration(read_model(chain.transitions()), 0.5)
    assert_allclose(agent.learner.values(SEEN, 0), best, atol=0.1)


def test_with_long_returns_it_learns_the_way_along_a_chain(chain):
    agent = taught(new_pqn(rollout={"trace_decay": 0.9}), 500, chain)
    assert agent.policy(agent.weights()).act(SEEN).tolist() == [1] * 5


@pytest.mark.parametrize(("terminated", "value"), [(False, 2.0), (True, 1.0)])
def test_an_episode_cut_off_still_bootstraps_and_one_that_ended_does_not(
    terminated: bool, value: float
):
    agent = new_pqn(
        learning={"learning_rate_end": 1e-4, "learning_rate_duration": 700},
        rollout={"trace_decay": 0.9},
    )
    here, there = (np.repeat(SEEN[[state]], NUM_ENVS, axis=0) for state in (0, 2))
    ends, no = np.ones(NUM_ENVS, bool), np.zeros(NUM_ENVS, bool)
    steps = StepResult(here, np.ones(NUM_ENVS), *((ends, no) if terminated else (no, ends)))
    decoy = StepResult(there, np.full(NUM_ENVS, 8.0), ends, no)
    for _ in range(1_200):  # every step is an episode's last; the next one's 8 is nothing to it
        agent.observe(here, agent.act(here), steps, there)
        agent.observe(there, agent.act(there), decoy, here)
    learned = agent.learner.values(SEEN[[0, 2]], 0)
    assert_allclose(learned.max(axis=1), [value, 8], atol=0.1)  # 1/(1 − ½), or 1


def test_it_learns_once_a_rollout_is_whole_from_minibatches_of_all_of_it():
    agent = new_pqn()
    rows = random_rows(25)
    weights = [online(agent)]
    for before, after in pairwise(range(0, 25, 8)):
        feed(agent, rows[before:after])  # seven steps
        assert_array_equal(online(agent), weights[-1])
        feed(agent, rows[after - 1 : after + 1])
        weights.append(online(agent))
        assert not np.array_equal(*weights[-2:])
        assert agent.updates == 4 * (len(weights) - 1)  # two epochs of two minibatches
    assert agent.env_steps == 24 * NUM_ENVS


def test_metrics_come_once_a_period_of_updates():
    agent, no = new_pqn(metrics_period=6), np.zeros(NUM_ENVS, bool)
    given = []
    for o_tm1, o_t in pairwise(random_rows(49)):
        steps = StepResult(o_t, np.ones(NUM_ENVS), no, no)
        given.append(agent.observe(o_tm1, agent.act(o_tm1), steps, o_t) is not None)
    # after 4, 8, 12, 16, 20 and 24 updates, a rollout each
    assert [at for at, measured in enumerate(given, start=1) if measured] == [16, 24, 40, 48]


@pytest.mark.parametrize("steps", [13, 16])
def test_an_agent_restored_in_mid_rollout_goes_on_as_if_nothing_had_happened(steps: int):
    rows = random_rows(60)
    agent, resumed = new_pqn(), new_pqn()
    feed(agent, rows[: steps + 1])
    resumed.restore(copy.deepcopy(agent.state()))
    for rng_of in (lambda it: it._rng, lambda it: it._actor._explorer._rng):
        rng_of(resumed).bit_generator.state = rng_of(agent).bit_generator.state
    assert feed(agent, rows[steps:]) == feed(resumed, rows[steps:])
    assert_array_equal(online(agent), online(resumed))
    assert (agent.epsilon, agent.num_filled) == (resumed.epsilon, resumed.num_filled)


def test_a_checkpoint_with_a_rollout_that_is_complete_is_refused():
    agent = new_pqn()
    with pytest.raises(ValueError, match=r"agent\.filled = 8: must be less than 8 steps"):
        agent.restore(agent.state() | {"filled": 8})


def test_one_seed_repeats_and_another_differs(chain):
    one, same, other = (taught(new_pqn(seed), 40, chain) for seed in (3, 3, 4))
    assert_array_equal(online(one), online(same))
    assert not np.isclose(online(one), online(other)).all()


def test_the_values_of_the_next_actions_are_those_computed_apart():
    agent, rows = new_pqn(), random_rows(9)
    feed(agent, rows)
    assert agent._actor.next_q is not None
    apart = agent.learner.values(rows[-1], 0)
    assert_allclose(agent._actor.next_q, apart, rtol=1e-4, atol=1e-5)


def test_each_environment_learns_from_its_steps_or_from_all_their_images(
    monkeypatch: pytest.MonkeyPatch,
):
    agent, rows = new_pqn(rollout={"mirror_half": True}), random_rows(81)
    learned = []
    fit = agent.learner.fit_rollout

    def noted(rollout: Rollout, *rest: Any) -> Any:
        learned.append(copy.deepcopy(rollout))
        return fit(rollout, *rest)

    monkeypatch.setattr(agent.learner, "fit_rollout", noted)
    acted = [np.frombuffer(each, np.int64) for each in feed(agent, rows)]
    assert len(learned) == 10
    images = 0
    for number, rollout in enumerate(learned):
        first = 8 * number
        o_tm1, o_t = rows[first : first + 8], rows[first + 1 : first + 9]
        a_tm1 = np.array(acted[first : first + 8])
        for env in range(NUM_ENVS):
            is_image = not np.array_equal(rollout.o_t[:, env], o_t[:, env])
            images += is_image
            seen = [o_tm1[:, env], o_t[:, env], a_tm1[:, env]]
            if is_image:
                seen = [
                    seen[0][:, [1, 0, 2, 3, 4]] * [1, 1, -1, 1, 1],
                    seen[1][:, [1, 0, 2, 3, 4]] * [1, 1, -1, 1, 1],
                    1 - seen[2],
                ]
            assert_array_equal(rollout.o_tm1[:, env], seen[0])
            assert_array_equal(rollout.o_t[:, env], seen[1])
            assert_array_equal(rollout.a_tm1[:, env], seen[2])
        assert_array_equal(rollout.r_t, o_t[..., 0])  # a reward is that of its image
    assert 10 <= images <= 30  # of 40


def test_images_need_a_symmetry():
    config = Config(algorithm="pqn", rollout=RolloutConfig(mirror_half=True))
    spaces = Spaces(observation_size=5, num_actions=2)
    with pytest.raises(UserError, match=r"mirror_half = True.*declares no mirror symmetry"):
        PQNAgent(config, spaces, streams(0), make_learner(config, spaces))


def test_the_policy_is_the_average_of_the_weights_after_each_rollout(chain):
    agent = new_pqn(learning={"averaging": 0.25})
    average, before = online(agent), 0
    for _ in islice(fly(agent, *(chain() for _ in range(NUM_ENVS))), 50):
        if agent.updates > before:
            average += np.float32(0.25) * (online(agent) - average)
            before = agent.updates
    assert before == 4 * 6
    layers = agent.learner.model.layers(average)
    for name, weights in agent.weights().items():
        assert_array_equal(weights, layers[name])
