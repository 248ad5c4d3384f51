import gymnasium as gym
import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose

from touchdown.agents.planning import TransitionModel, read_model, value_iteration
from touchdown.agents.tabular_targets import (
    expected_sarsa_target,
    q_learning_target,
    sarsa_target,
)


def env_and_model(env_id: str, **options) -> tuple[gym.Env, TransitionModel]:
    env = gym.make(env_id, **options)
    return env, read_model(env.unwrapped.P)


def test_q_learning_s_target_takes_the_best_next_value():
    assert q_learning_target(1.0, 0.5, np.array([2.0, 4.0, 3.0])) == 3.0  # 1 + ½·4
    assert q_learning_target(1.0, 0.5, np.array([-8.0, -4.0])) == -1.0  # the best of bad is not 0


def test_sarsa_s_target_takes_the_next_action_s_value_though_another_is_better():
    assert sarsa_target(1.0, 0.5, np.array([2.0, 90.0, -6.0]), 2) == -2.0  # 1 − ½·6


def test_expected_sarsa_s_target_weighs_all_next_values():
    q_t = np.array([8.0, 0.0, 4.0, 0.0])
    # π = 0.7, 0.1, 0.1, 0.1: the greedy action is among the random ones
    assert_allclose(expected_sarsa_target(1.0, 0.5, q_t, 0.4), 4.0)  # 1 + ½·(5.6 + 0.4)


def test_expected_sarsa_is_q_learning_without_exploration_and_the_mean_with_nothing_else():
    q_t = np.array([2.0, 4.0, 9.0])
    assert expected_sarsa_target(1.0, 0.5, q_t, 0.0) == q_learning_target(1.0, 0.5, q_t) == 5.5
    assert expected_sarsa_target(1.0, 0.5, q_t, 1.0) == 3.5  # 1 + ½·5


def test_expected_sarsa_is_the_mean_of_sarsa_over_the_actions_drawn():
    q_t, epsilon, rng = np.array([1.0, 5.0, 5.0, -3.0]), 0.3, default_rng(0)
    a_t = np.where(rng.random(40_000) < epsilon, rng.integers(4, size=40_000), q_t.argmax())
    sarsa = [sarsa_target(1.0, 0.9, q_t, a) for a in a_t]
    assert_allclose(np.mean(sarsa), expected_sarsa_target(1.0, 0.9, q_t, epsilon), atol=0.05)


def test_a_discount_of_zero_leaves_the_reward_of_every_target():
    q_t = np.array([70.0, 90.0])
    assert q_learning_target(7.0, 0.0, q_t) == 7.0
    assert sarsa_target(7.0, 0.0, q_t, 1) == 7.0
    assert expected_sarsa_target(7.0, 0.0, q_t, 0.5) == 7.0


def test_targets_of_a_batch_are_those_of_its_rows():
    rng = default_rng(0)
    q_t, r_t = rng.normal(size=(32, 4)), rng.normal(size=32)
    discount_t, a_t = rng.choice([0.0, 0.9], 32), rng.integers(4, size=32)
    epsilon = rng.random(32)
    rows = range(32)
    assert_allclose(
        q_learning_target(r_t, discount_t, q_t),
        [q_learning_target(r_t[i], discount_t[i], q_t[i]) for i in rows],
    )
    assert_allclose(
        sarsa_target(r_t, discount_t, q_t, a_t),
        [r_t[i] + discount_t[i] * q_t[i][a_t[i]] for i in rows],
    )
    assert_allclose(
        expected_sarsa_target(r_t, discount_t, q_t, epsilon),
        [expected_sarsa_target(r_t[i], discount_t[i], q_t[i], epsilon[i]) for i in rows],
    )


def learn(env: gym.Env, gamma: float, num_steps: int, seed: int) -> np.ndarray:
    """Q-learning from random actions with a step size of 1, exact as nothing is random."""
    rng, q = default_rng(seed), np.zeros((env.observation_space.n, env.action_space.n))
    state, _ = env.reset(seed=seed)
    for _ in range(num_steps):
        action = int(rng.integers(q.shape[1]))
        next_state, r_t, terminated, truncated, _ = env.step(action)
        discount_t = 0.0 if terminated else gamma
        q[state, action] = q_learning_target(r_t, discount_t, q[next_state])
        state = env.reset()[0] if terminated or truncated else next_state
    return q


def test_q_learning_reaches_the_values_that_value_iteration_finds():
    env, model = env_and_model("FrozenLake-v1", is_slippery=False)
    assert_allclose(learn(env, 0.9, 30_000, seed=0), value_iteration(model, 0.9), atol=1e-6)


@pytest.mark.parametrize(("epsilon", "length"), [(0.2, 15), (0.0, 13)])
def test_expected_sarsa_keeps_off_the_cliff_as_far_as_it_explores(epsilon: float, length: int):
    env, model = env_and_model("CliffWalking-v1")
    q = np.zeros_like(model.reward)
    for _ in range(3000):  # every target at once, as a sweep does
        after = [
            [expected_sarsa_target(r, float(not end), q[s_t], epsilon) for _, s_t, r, end in [only]]
            for actions in env.unwrapped.P.values()
            for (only,) in actions.values()
        ]
        before, q = q, np.reshape(after, q.shape)
        if np.abs(q - before).max() < 1e-6:
            break
    state, steps = 36, 0
    while state != 47 and steps < 50:
        ((_, state, _, _),) = env.unwrapped.P[state][int(q[state].argmax())]
        steps += 1
    assert state == 47
    assert steps >= length
    assert (steps == 13) == (epsilon == 0.0)
