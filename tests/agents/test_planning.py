import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from touchdown.agents.planning import TransitionModel, read_model, sweep, value_iteration

LEFT, DOWN, RIGHT, UP = range(4)  # of the frozen lake

# action 0 stays in state 0 for 1; action 1 goes to state 1 for nothing; from there 0 goes back for
# 4, and 1 terminates for 10, "in" state 0, whose value must not be added
TWO_STATES = {
    0: {0: [(1.0, 0, 1.0, False)], 1: [(1.0, 1, 0.0, False)]},
    1: {0: [(1.0, 0, 4.0, False)], 1: [(1.0, 0, 10.0, True)]},
}


def env_and_model(env_id: str, **options) -> tuple[gym.Env, TransitionModel]:
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
def test_a_table_of_transitions_that_is_no_model_is_refused(transitions: dict):
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
    _, model = env_and_model("FrozenLake-v1", is_slippery=False)
    q = value_iteration(model, 0.9)
    assert_allclose(q[14, RIGHT], 1.0)  # into the goal
    assert_allclose(q[14, LEFT], 0.9**2)  # away from it and back
    assert_allclose(q[0].max(), 0.9**5)  # six steps, the last of which pays
    assert_array_equal(q[[5, 7, 11, 12, 15]], np.zeros((5, 4)))  # holes and goal
    assert q[4, RIGHT] == 0.0  # into a hole


def test_values_of_the_slippery_lake_solve_their_equation():
    env, model = env_and_model("FrozenLake-v1")
    q = value_iteration(model, 0.99)
    for s, actions in env.unwrapped.P.items():
        for a, outcomes in actions.items():
            backup = sum(p * (r + 0.99 * (not end) * max(q[s_t])) for p, s_t, r, end in outcomes)
            assert_allclose(q[s, a], backup, atol=1e-9)


def test_the_best_path_along_the_cliff_is_thirteen_steps():
    env, model = env_and_model("CliffWalking-v1")
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
    env, model = env_and_model("Taxi-v4")
    q = value_iteration(model, 0.9)
    in_taxi, at_r = env.unwrapped.encode(0, 0, 4, 0), env.unwrapped.encode(0, 0, 0, 0)
    assert_allclose(q[in_taxi, 5], 20.0)
    assert q[at_r].max() > 10  # the decoy: pick up again, drop again
    assert_allclose(q[env.unwrapped.encode(1, 0, 4, 0)].max(), 17.0)  # −1 + 0.9·20
    assert q.max() == 20.0
