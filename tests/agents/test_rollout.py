import jax.numpy as jnp
import numpy as np
from numpy.testing import assert_allclose

from touchdown.agents import td
from touchdown.agents.rollout import Rollout, rollout_targets
from touchdown.config.config import Config
from touchdown.config.sections import LearningConfig, RolloutConfig

T, N, A = 7, 5, 3
CONFIG = Config(
    algorithm="pqn",
    learning=LearningConfig(gamma=0.9, reward_scale=0.5),
    rollout=RolloutConfig(rollout_steps=T, trace_decay=0.8),
)


def test_targets_of_a_rollout_are_those_of_the_jax_function():
    rng = np.random.default_rng(0)
    ends = rng.integers(3, size=(T, N))  # 1: terminated, 2: truncated
    rollout = Rollout(
        None,
        None,
        rng.normal(size=(T, N)).astype(np.float32),
        None,
        *((ends == kind).astype(np.float32) for kind in (1, 2)),
    )
    q_t = rng.normal(size=(T * N, A)).astype(np.float32)
    twin = td.lambda_returns(
        jnp.array(rollout.r_t * 0.5),
        jnp.array(0.9 * (1 - rollout.terminated)),
        jnp.array(q_t.max(axis=1).reshape(T, N)),
        jnp.array(rollout.truncated),
        0.8,
    )
    targets = rollout_targets(rollout, q_t, CONFIG)
    assert targets.dtype == np.float32
    assert_allclose(targets, twin, rtol=1e-5, atol=1e-6)


def test_a_return_of_two_steps_can_be_checked_in_the_head():
    config = Config(
        algorithm="pqn",
        learning=LearningConfig(gamma=0.5),
        rollout=RolloutConfig(rollout_steps=2, minibatches=1, trace_decay=0.5),
    )
    column = np.zeros((2, 1), np.float32)
    rollout = Rollout(None, None, column + 1, None, column, column)
    q_t = np.array([[8, 2], [4, 0]], np.float32)
    # G₁ = 1 + ½·4; G₀ = 1 + ½·(½·3 + ½·8)
    assert rollout_targets(rollout, q_t, config).tolist() == [[3.75], [3.0]]
