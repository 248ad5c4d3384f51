import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from touchdown.agents.tabular_math import (
    Grid,
    Model,
    OneHot,
    expected_sarsa_target,
    q_learning_target,
    read_model,
    sarsa_target,
    sweep,
    value_iteration,
)

LEFT, DOWN, RIGHT, UP = range(4)  # of the frozen lake

# action 0 stays in state 0 for 1; action 1 goes to state 1 for nothing; from there 0 goes back for
# 4, and 1 ends the world for 10, "in" state 0, whose value must not be added
TWO_STATES = {
    0: {0: [(1.0, 0, 1.0, False)], 1: [(1.0, 1, 0.0, False)]},
    1: {0: [(1.0, 0, 4.0, False)], 1: [(1.0, 0, 10.0, True)]},
}


def world_of(env_id: str, **options) -> tuple[gym.Env, Model]:
    env = gym.make(env_id, **options)
    return env, read_model(env.unwrapped.P)


def random_transitions(rng: np.random.Generator, states: int, actions: int) -> dict:
    """Each state and action leads to three states, sometimes the same, and sometimes ends."""
    return {
        s: {
            a: [
                (float(p), int(rng.integers(states)), float(rng.normal()), bool(rng.random() < 0.3))
                for p in rng.dirichlet(np.ones(3))
            ]
            for a in range(actions)
        }
        for s in range(states)
    }


def test_a_model_has_expected_rewards_and_chances_to_go_on():
    model = read_model({
        0: {0: [(0.5, 0, 8.0, False), (0.25, 0, 4.0, False), (0.25, 1, -4.0, True)]},
        1: {0: [(1.0, 1, 0.0, True)]},
    })  # fmt: skip
    assert_array_equal(model.reward, [[4.0], [0.0]])  # ½·8 + ¼·4 − ¼·4
    assert_array_equal(
        model.continues, [[[0.75, 0.0]], [[0.0, 0.0]]]
    )  # the end at 1 is not counted


@pytest.mark.parametrize(
    "transitions",
    [
        {},
        {1: {0: [(1.0, 1, 0.0, False)]}},
        {0: {}},
        {0: {1: [(1.0, 0, 0.0, False)]}},
        {0: {0: []}},
        {0: {0: [(0.5, 0, 0.0, False)]}},
        {0: {0: [(1.5, 0, 0.0, False), (-0.5, 0, 0.0, False)]}},
        {0: {0: [(1.0, 1, 0.0, False)]}},
    ],
)
def test_a_table_of_transitions_that_is_no_world_is_refused(transitions: dict):
    with pytest.raises(ValueError, match="state"):
        read_model(transitions)


def test_a_sweep_backs_up_the_best_next_value_but_none_past_the_end():
    q = sweep(np.array([[6.0, 2.0], [-8.0, -4.0]]), read_model(TWO_STATES), 0.5)
    assert_array_equal(q, [[4.0, -2.0], [7.0, 10.0]])  # 1 + ½·6, 0 + ½·(−4); 4 + ½·6, 10


def test_value_iteration_finds_the_values_of_two_states():
    q = value_iteration(read_model(TWO_STATES), 0.5)
    # V = 5 and 10: going over at once is worth ½·10; the end pays more than 4 + ½·5
    assert_allclose(q, [[3.5, 5.0], [6.5, 10.0]], atol=1e-9)


def test_a_sweep_is_three_loops_over_the_transitions():
    transitions = random_transitions(default_rng(0), 7, 3)
    q = default_rng(1).normal(size=(7, 3))
    slow = np.zeros((7, 3))
    for s, actions in transitions.items():
        for a, outcomes in actions.items():
            for p, s_t, r_t, terminated in outcomes:
                slow[s, a] += p * (r_t + (0.0 if terminated else 0.9 * max(q[s_t])))
    assert_allclose(sweep(q, read_model(transitions), 0.9), slow)


@given(arrays(float, (2, 5, 2), elements=st.floats(-100, 100)))
def test_a_sweep_brings_any_two_tables_closer(tables: np.ndarray):
    model = read_model(random_transitions(default_rng(2), 5, 2))
    first, second = (sweep(q, model, 0.9) for q in tables)
    apart = np.abs(tables[0] - tables[1]).max()
    assert np.abs(first - second).max() <= 0.9 * apart + 1e-9


@pytest.mark.parametrize("gamma", [-0.1, 1.1, float("nan")])
def test_a_gamma_outside_of_0_to_1_is_refused(gamma: float):
    with pytest.raises(ValueError, match="gamma"):
        value_iteration(read_model(TWO_STATES), gamma)


def test_value_iteration_says_so_where_values_grow_for_ever():
    with pytest.raises(ValueError, match="no fixed point within 50 sweeps"):
        value_iteration(read_model(TWO_STATES), 1.0, max_sweeps=50)  # 1 a step, without an end


def test_values_of_the_lake_without_slips_are_powers_of_gamma():
    _, model = world_of("FrozenLake-v1", is_slippery=False)
    q = value_iteration(model, 0.9)
    assert_allclose(q[14, RIGHT], 1.0)  # into the goal
    assert_allclose(q[14, LEFT], 0.9**2)  # away from it and back
    assert_allclose(q[0].max(), 0.9**5)  # six steps, the last of which pays
    assert_array_equal(q[[5, 7, 11, 12, 15]], np.zeros((5, 4)))  # holes and goal
    assert q[4, RIGHT] == 0.0  # into a hole


def test_values_of_the_slippery_lake_solve_their_equation():
    env, model = world_of("FrozenLake-v1")
    q = value_iteration(model, 0.99)
    for s, actions in env.unwrapped.P.items():
        for a, outcomes in actions.items():
            backup = sum(p * (r + 0.99 * (not end) * max(q[s_t])) for p, s_t, r, end in outcomes)
            assert_allclose(q[s, a], backup, atol=1e-9)


def test_the_best_path_along_the_cliff_is_thirteen_steps():
    env, model = world_of("CliffWalking-v1")
    q = value_iteration(model, 1.0)
    assert q[36].max() == -13
    assert q[36, 1] == -100 - 13  # right falls and is put back to the start
    state, _ = env.reset()
    steps, terminated = 0, False
    while not terminated:
        state, _, terminated, _, _ = env.step(q[state].argmax())
        steps += 1
    assert steps == 13


def test_a_drop_off_of_the_taxi_ends_though_the_state_after_it_has_a_value():
    env, model = world_of("Taxi-v4")
    q = value_iteration(model, 0.9)
    in_taxi, at_r = env.unwrapped.encode(0, 0, 4, 0), env.unwrapped.encode(0, 0, 0, 0)
    assert_allclose(q[in_taxi, 5], 20.0)
    assert q[at_r].max() > 10  # the decoy: pick up again, drop again
    assert_allclose(q[env.unwrapped.encode(1, 0, 4, 0)].max(), 17.0)  # −1 + 0.9·20
    assert q.max() == 20.0


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
    """Q-learning of a deterministic world from random actions; a step size of 1 is exact there."""
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
    env, model = world_of("FrozenLake-v1", is_slippery=False)
    assert_allclose(learn(env, 0.9, 30_000, seed=0), value_iteration(model, 0.9), atol=1e-6)


@pytest.mark.parametrize(("epsilon", "length"), [(0.2, 15), (0.0, 13)])
def test_expected_sarsa_keeps_off_the_cliff_as_far_as_it_explores(epsilon: float, length: int):
    env, model = world_of("CliffWalking-v1")
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


def test_one_hot_observations_are_numbered_by_their_one():
    assert_array_equal(OneHot(3).states(np.array([[0, 0, 1], [1, 0, 0]], np.float32)), [2, 0])
    env = gym.wrappers.FlattenObservation(gym.make("Taxi-v4"))
    observation, _ = env.reset(seed=0)
    assert OneHot(500).states(observation[None])[0] == env.unwrapped.s


@pytest.mark.parametrize("rows", [[[0, 0]], [[1, 1]], [[0, 2]], [[1, -1]], [[1, 0, 0]], [1, 0]])
def test_observations_that_are_not_one_hot_are_refused(rows: list):
    with pytest.raises(ValueError, match="observations must be"):
        OneHot(2).states(np.array(rows, float))


def test_one_hot_needs_a_state():
    with pytest.raises(ValueError, match="1 state"):
        OneHot(0)


def test_a_grid_numbers_its_cells_with_the_last_dimension_fastest():
    grid = Grid((2, 3), low=(0.0, -3.0), high=(1.0, 3.0))
    assert grid.num_states == 6
    observations = np.array([[0.2, -2.0], [0.2, 0.0], [0.2, 2.0], [0.7, -2.0], [0.7, 2.0]])
    assert_array_equal(grid.states(observations), [0, 1, 2, 3, 5])


def test_a_bin_holds_its_lower_edge_and_the_last_bin_its_upper_edge_too():
    grid = Grid((4,), (0.0,), (4.0,))
    assert_array_equal(grid.states(np.array([[0.0], [1.0], [1.99], [3.0], [4.0]])), [0, 1, 1, 3, 3])


def test_what_lies_outside_goes_to_the_bins_at_the_ends():
    grid = Grid((4,), (0.0,), (4.0,))
    outside = np.array([[-1.0], [-np.inf], [5.0], [np.inf], [np.finfo(np.float64).max]])
    assert_array_equal(grid.states(outside), [0, 0, 3, 3, 3])


@given(
    st.lists(st.integers(1, 5), min_size=1, max_size=3).flatmap(
        lambda bins: st.tuples(
            st.just(tuple(bins)),
            arrays(float, (4, len(bins)), elements=st.floats(allow_nan=False)),
        )
    )
)
def test_every_observation_has_a_state_and_it_is_that_of_a_slow_search(drawn: tuple):
    bins, observations = drawn
    grid = Grid(bins, (-1.0,) * len(bins), (3.0,) * len(bins))
    states = grid.states(observations)
    assert ((states >= 0) & (states < grid.num_states)).all()
    for state, observation in zip(states, observations, strict=True):
        for cell, count, value in zip(
            np.unravel_index(state, bins), bins, observation, strict=True
        ):
            width = 4.0 / count
            assert cell == 0 or value >= -1.0 + cell * width - 1e-9
            assert cell == count - 1 or value <= -1.0 + (cell + 1) * width + 1e-9


@pytest.mark.parametrize(
    ("bins", "low", "high"),
    [
        ((), (), ()),
        ((2, 2), (0.0,), (1.0,)),
        ((2,), (0.0,), (1.0, 2.0)),
        ((0,), (0.0,), (1.0,)),
        ((2,), (1.0,), (1.0,)),
        ((2,), (2.0,), (1.0,)),
        ((2,), (-np.inf,), (1.0,)),
        ((2,), (0.0,), (np.nan,)),
        ((2,), (-1.7e308,), (1.7e308,)),
    ],
)
def test_a_grid_that_cannot_be_is_refused(bins: tuple, low: tuple, high: tuple):
    with pytest.raises(ValueError, match=r"need|must"):
        Grid(bins, low, high)


@pytest.mark.parametrize("rows", [[[np.nan, 0.0]], [[0.0]], [0.0, 0.0]])
def test_observations_that_a_grid_cannot_place_are_refused(rows: list):
    with pytest.raises(ValueError, match="observations must be"):
        Grid((2, 2), (0.0, 0.0), (1.0, 1.0)).states(np.array(rows))
