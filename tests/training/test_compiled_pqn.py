"""The compiled loop of PQN: its arguments. `test_compiled` compares it with Python's loop."""

from typing import Any

import numpy as np
import pytest

from touchdown.agents.learners._fused import Perceptron
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.registry import make_agent
from touchdown.config.config import Config
from touchdown.config.sections import LearningConfig, NetworkConfig, RolloutConfig, TrainingConfig
from touchdown.core.seeding import streams, training_start
from touchdown.envs.pool import ExactEnvPool, make_pool
from touchdown.training import _train
from touchdown.training.compiled_pqn import CompiledPQN
from touchdown.training.loop import begin

CONFIG = Config(
    algorithm="pqn",
    network=NetworkConfig(hidden_sizes=(12, 8)),
    learning=LearningConfig(backend="fused"),
    rollout=RolloutConfig(rollout_steps=5, minibatches=2, epochs=2),
    training=TrainingConfig(num_envs=2),
)


class Arguments:
    """Arguments of `PqnLoop.advance` for two environments, valid until one is replaced."""

    def __init__(self) -> None:
        self.streams = streams(0)
        pool = make_pool(CONFIG.env_id, 2, "exact")
        agent = make_agent(CONFIG, pool.spaces, self.streams)
        assert isinstance(agent, PQNAgent)
        assert isinstance(pool, ExactEnvPool)
        assert isinstance(agent.learner, FusedLearner)
        self.batch = pool.batch
        underway = begin(pool, lambda episode: training_start(0, episode), 2)
        self.counts = _train.Counts()
        self.counts.epsilon = 1.0
        self.pool = [pool.actions, pool.observations, pool.rewards, pool.terminated, pool.steps]
        self.episodes = [
            *(underway.observations, underway.returns),
            *(underway.steps, underway.actions),
        ]
        self.rollout = list(agent.rollout)
        state = agent.learner.state
        self.learner = [state.online_params, None, state.mu, state.nu]
        self.q = np.zeros((2, 4), np.float32)

    def loop(self, network: dict[str, Any] | None = None, **settings: Any) -> _train.PqnLoop:
        given = _train.Settings()
        given.max_episode_steps = 1_000
        given.rollout_steps, given.epochs, given.minibatches = 5, 2, 2
        for name, value in settings.items():
            setattr(given, name, value)
        rngs = [each.bit_generator for each in self.streams]
        shape: dict[str, Any] = {"num_observations": 8, "hidden_sizes": (12, 8), "num_actions": 4}
        return _train.PqnLoop(
            self.batch, *rngs, given, Perceptron(**(shape | (network or {}))).network
        )

    def advance(self, loop: _train.PqnLoop, max_steps: int = 1) -> object:
        return loop.advance(
            max_steps,
            self.counts,
            _train.PoolArrays(*self.pool),
            _train.EpisodeArrays(*self.episodes),
            _train.RolloutArrays(*self.rollout),
            _train.LearnerArrays(*self.learner),
            self.q,
        )


@pytest.mark.parametrize(
    ("part", "index", "wrong", "complaint"),
    [
        ("pool", 0, np.zeros(3, np.int64), "actions has 3 rows, must have 2"),
        ("episodes", 1, np.zeros(1), "returns has 1 entries, must have 2"),
        ("rollout", 0, np.zeros((4, 2, 8), np.float32), "o_tm1 of the rollout has 4 entries, must"),
        ("rollout", 1, np.zeros((5, 3), np.int32), "a_tm1 of the rollout has 3 rows, must have 2"),
        ("rollout", 2, np.zeros((6, 2), np.float32), "r_t of the rollout has 6 entries, must have"),
        ("rollout", 3, np.zeros((5, 1, 8), np.float32), "o_t of the rollout has 1 rows, must have"),
        ("rollout", 4, np.zeros((1, 2), np.float32), "terminated of the rollout has 1 entries"),
        ("rollout", 5, np.zeros((5, 0), np.float32), "truncated of the rollout has 0 rows, must"),
        ("learner", 0, np.zeros(9, np.float32), "online has 9 entries, must have 248"),
        ("learner", 2, np.zeros(9, np.float32), "mu has 9 entries, must have 248"),
    ],
)
def test_a_wrong_array_is_refused_before_anything_is_written(part, index, wrong, complaint):
    arguments = Arguments()
    loop = arguments.loop()
    getattr(arguments, part)[index] = wrong
    before = arguments.streams.exploration.bit_generator.state
    with pytest.raises(ValueError, match=complaint):
        arguments.advance(loop)
    assert arguments.streams.exploration.bit_generator.state == before
    assert arguments.counts.env_steps == 0


def test_wrong_counts_and_values_are_refused():
    arguments = Arguments()
    loop = arguments.loop()
    with pytest.raises(ValueError, match="max_steps = -1: must be at least 0"):
        arguments.advance(loop, -1)
    for filled in (-1, 5):
        arguments.counts.filled = filled
        with pytest.raises(ValueError, match=f"filled = {filled}: must be from 0 to 4"):
            arguments.advance(loop)
    arguments.counts.filled, arguments.counts.updates = 0, -1
    with pytest.raises(ValueError, match="updates = -1: must be at least 0"):
        arguments.advance(loop)
    arguments.counts.updates = 0
    arguments.q = np.zeros((2, 3), np.float32)
    with pytest.raises(ValueError, match="a row of q has 3 entries, must have 4"):
        arguments.advance(loop)


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"rollout_steps": 0}, "rollout_steps = 0: must be at least 1"),
        ({"rollout_steps": 2**31}, "rollout_steps = 2147483648: must be at most 1073741823"),
        ({"epochs": 0}, "epochs = 0: must be at least 1"),
        ({"minibatches": 0}, "minibatches = 0: must be at least 1"),
        ({"minibatches": 11}, "minibatches = 11 of 10 steps: must have from 1 to 1048576 each"),
        ({"rollout_steps": 2**21}, "minibatches = 2 of 4194304 steps: must have from 1 to 1048576"),
        ({"metrics_period": 0}, "metrics_period = 0: must be at least 1"),
    ],
)
def test_wrong_settings_are_refused(settings, complaint):
    with pytest.raises(ValueError, match=complaint):
        Arguments().loop(**settings)


@pytest.mark.parametrize(
    ("network", "complaint"),
    [
        ({"num_observations": 7}, "an observation of the network has 7 entries, must have 8"),
        ({"num_actions": 3}, "a row of the network's values has 3 entries, must have 4"),
        ({"noisy": True}, "a noisy network: must have no noise"),
        ({"quantiles": 5}, "a network that predicts quantiles or atoms: must predict values"),
    ],
)
def test_a_network_that_the_loop_does_not_support_is_refused(network, complaint):
    with pytest.raises(ValueError, match=complaint):
        Arguments().loop(network)


def test_a_stored_action_that_the_network_does_not_have_is_refused():
    arguments = Arguments()
    arguments.counts.filled = 4
    arguments.rollout[1][2, 1] = 4
    with pytest.raises(ValueError, match="rollout has action 4: must be from 0 to 3"):
        arguments.advance(arguments.loop())


def test_another_learner_than_the_fused_one_is_refused():
    generators = streams(0)
    pool = make_pool(CONFIG.env_id, 2, "exact")
    config = Config(algorithm="pqn", training=CONFIG.training)
    agent = make_agent(config, pool.spaces, generators)
    with pytest.raises(TypeError, match="the compiled loop needs a FusedLearner, got"):
        CompiledPQN(agent, pool, generators, config)


def test_averaging_needs_an_average_to_write_to():
    arguments = Arguments()
    with pytest.raises(ValueError, match="average = None: must be given"):
        arguments.advance(arguments.loop(averaging=0.1))
