import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose

from touchdown.agents.td import (
    categorical_loss,
    categorical_projection,
    double_q_error,
    lambda_returns,
    of_action,
    q_error,
    quantile_loss,
    sarsa_error,
)


def error_of(q_tm1, a_tm1, r_t, discount_t, q_t) -> np.ndarray:
    return np.asarray(
        q_error(
            jnp.array(q_tm1, float),
            jnp.array(a_tm1),
            jnp.array(r_t, float),
            jnp.array(discount_t, float),
            jnp.array(q_t, float),
        )
    )


def test_q_error_is_reward_and_discounted_best_next_value_less_the_value_of_the_action_taken():
    delta = error_of([[5, 1, -9]], [0], [1], [0.5], [[2, 4, 3]])
    assert_allclose(delta, [-2])  # 1 + ½·4 − 5


def test_q_error_takes_the_value_of_the_action_taken_though_another_is_better():
    delta = error_of([[50, 60, 3]], [2], [1], [0.5], [[-8, -4, -6]])
    assert_allclose(delta, [-4])  # 1 + ½·(−4) − 3: the best of bad values is not 0


def test_q_error_bootstraps_from_the_next_values_though_those_before_are_larger():
    delta = error_of([[1, 1000]], [0], [0], [1], [[3, 2]])
    assert_allclose(delta, [2])  # 0 + 3 − 1


def test_discount_of_zero_stops_the_bootstrap_in_its_own_row_alone():
    delta = error_of([[1, 0], [1, 0]], [0, 0], [7, 7], [0, 1], [[100, 90], [100, 90]])
    assert_allclose(delta, [6, 106])


def test_a_batch_is_its_transitions_one_by_one():
    rng = default_rng(0)
    q_tm1, q_t = rng.normal(size=(2, 64, 4))
    a_tm1 = rng.integers(4, size=64)
    r_t, discount_t = rng.normal(size=64), rng.choice([0.0, 0.9], 64)
    slow = [r_t[i] + discount_t[i] * max(q_t[i].tolist()) - q_tm1[i][a_tm1[i]] for i in range(64)]
    assert_allclose(error_of(q_tm1, a_tm1, r_t, discount_t, q_t), slow, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("action", [0, 1])
def test_gradient_lowers_the_value_of_the_action_taken_and_no_other(action: int):
    slope = jax.grad(
        lambda q_tm1: q_error(
            q_tm1, jnp.array([action]), jnp.zeros(1), jnp.ones(1), jnp.array([[3.0, 4.0]])
        )[0]
    )(jnp.array([[1.0, 2.0]]))
    assert np.asarray(slope)[0].tolist() == [-1.0 * (action == 0), -1.0 * (action == 1)]


def test_double_q_error_selects_by_the_online_values_and_evaluates_by_the_target_s():
    delta = double_q_error(
        jnp.array([[5.0, 1.0]]),
        jnp.array([0]),
        jnp.array([1.0]),
        jnp.array([0.5]),
        q_t_online=jnp.array([[0.0, 9.0]]),
        q_t_target=jnp.array([[7.0, 4.0]]),
    )
    assert_allclose(delta, [-2.0])  # 1 + ½·4 − 5: neither the target's own best, 7, nor 9


def test_double_q_error_is_the_plain_one_where_both_networks_are_one():
    q_tm1, q_t = default_rng(0).normal(size=(2, 20, 4))
    rest = jnp.arange(20) % 4, jnp.ones(20), jnp.full(20, 0.9)
    plain = q_error(jnp.array(q_tm1), *rest, jnp.array(q_t))
    double = double_q_error(jnp.array(q_tm1), *rest, jnp.array(q_t), jnp.array(q_t))
    assert_allclose(plain, double)


def test_quantile_loss_weighs_errors_by_the_side_on_which_they_lie():
    # θ at τ = ¼ and ¾; the target is 1 above the first and 3 below the second
    loss = quantile_loss(jnp.array([[0.0, 4.0]]), jnp.array([[1.0]]))
    assert_allclose(loss, [0.25 * 0.5 + 0.25 * 2.5])  # ¼ · ½·1² + |¾ − 1| · (3 − ½)


def test_quantile_loss_is_least_where_the_quantiles_are():
    targets = 100 * jnp.arange(1000.0)[None] / 1000
    at = jnp.array([[25.0, 75.0]])
    least = quantile_loss(at, targets)
    for shift in ([9, 0], [-9, 0], [0, 9], [0, -9]):
        assert quantile_loss(at + jnp.array([shift], float), targets)[0] > least[0]


def test_quantile_loss_takes_the_mean_over_targets_and_the_sum_over_quantiles():
    one = quantile_loss(jnp.array([[0.0]]), jnp.array([[1.0, 3.0]]))
    assert_allclose(one, [0.5 * (0.5 + 2.5) / 2])


# --- atoms ---

ENDS = [-1, 0, 1]


def projected(support, p_t, r_t, discount_t) -> np.ndarray:
    arrays = (jnp.array(value, float) for value in (support, p_t, r_t, discount_t))
    return np.asarray(categorical_projection(*arrays))


def test_an_atom_moved_between_two_others_is_shared_by_its_distance_from_each():
    phi = projected(ENDS, [[0, 1, 0], [0, 1, 0]], [0.5, -0.25], [1, 1])
    assert_allclose(phi, [[0, 0.5, 0.5], [0.25, 0.75, 0]])


def test_atoms_that_nothing_moves_keep_their_probabilities():
    assert_allclose(projected(ENDS, [[0.2, 0.3, 0.5]], [0], [1]), [[0.2, 0.3, 0.5]])


def test_where_the_episode_terminated_the_reward_is_all_of_the_return():
    phi = projected(ENDS, [[0.9, 0, 0.1], [0.9, 0, 0.1]], [0.75, 0.75], [0, 1])
    assert_allclose(phi[0], [0, 0.25, 0.75])
    assert_allclose(phi[1], [0.9 * 0.25, 0.9 * 0.75, 0.1], rtol=1e-6)  # ends at -¼, and past 1


def test_what_is_moved_past_an_end_of_the_support_stays_at_the_end():
    phi = projected(ENDS, [[0.5, 0, 0.5]] * 2, [7, -7], [1, 1])
    assert_allclose(phi, [[0, 0, 1], [1, 0, 0]])


def slow_projection(support, p_t, r_t, discount_t) -> np.ndarray:
    """The source's Algorithm 1: atom by atom, to the one below and the one above."""
    phi, width = np.zeros_like(p_t), support[1] - support[0]
    for row in range(len(p_t)):
        for z, p in zip(support, p_t[row], strict=True):
            moved = min(max(r_t[row] + discount_t[row] * z, support[0]), support[-1])
            place = (moved - support[0]) / width
            below = min(int(place), len(support) - 2)
            phi[row, below] += p * (below + 1 - place)
            phi[row, below + 1] += p * (place - below)
    return phi


def test_a_projection_is_the_loop_over_atoms_and_keeps_what_it_was_given():
    rng = default_rng(0)
    support = np.linspace(-4, 6, 51)
    p_t = rng.dirichlet(np.ones(51), size=40)
    r_t, discount_t = rng.normal(size=40) * 3, rng.choice([0.0, 0.9, 0.99**3], 40)
    phi = projected(support, p_t, r_t, discount_t)
    assert_allclose(phi, slow_projection(support, p_t, r_t, discount_t), rtol=1e-3, atol=2e-6)
    assert_allclose(phi.sum(axis=1), np.ones(40), rtol=1e-5)


def test_a_projection_within_the_ends_keeps_the_mean():
    p_t = default_rng(1).dirichlet(np.ones(21), size=10)
    support = np.linspace(-10, 10, 21)
    phi = projected(support, p_t, np.full(10, 0.3), np.full(10, 0.9))
    assert_allclose(phi @ support, 0.3 + 0.9 * (p_t @ support), rtol=1e-4, atol=1e-5)


def test_categorical_loss_is_the_cross_entropy_of_each_row():
    log_p = jnp.log(jnp.array([[0.5, 0.25, 0.25], [0.125, 0.5, 0.375]]))
    loss = categorical_loss(log_p, jnp.array([[0.0, 0.5, 0.5], [1.0, 0.0, 0.0]]))
    assert_allclose(loss, [2 * np.log(2), 3 * np.log(2)], rtol=1e-6)  # -log ¼ and -log ⅛


def test_categorical_loss_is_least_where_the_probabilities_are_the_target_s():
    target = jnp.array([[0.2, 0.3, 0.5]])
    slope = jax.grad(lambda logits: categorical_loss(jax.nn.log_softmax(logits), target)[0])
    assert_allclose(slope(jnp.log(target)), np.zeros((1, 3)), atol=1e-6)
    assert_allclose(slope(jnp.zeros((1, 3))), 1 / 3 - target, rtol=1e-5)  # p − Φ


def test_an_action_s_outputs_are_its_row_s_own_whatever_it_has_of_them():
    values = jnp.arange(12.0).reshape(2, 3, 2)
    assert of_action(values, jnp.array([2, 0])).tolist() == [[4, 5], [6, 7]]
    assert of_action(values[:, :, 1], jnp.array([2, 0])).tolist() == [5, 7]


# --- SARSA ---


def test_sarsa_error_bootstraps_from_the_action_taken_next_though_another_is_better():
    delta = sarsa_error(
        jnp.array([[5.0, 1.0, -9.0], [50.0, 60.0, 3.0]]),
        jnp.array([0, 2]),
        jnp.array([1.0, 1.0]),
        jnp.array([0.5, 0.5]),
        jnp.array([[2.0, 400.0, -300.0], [-8.0, 70.0, 90.0]]),
        jnp.array([0, 0]),
    )
    assert_allclose(delta, [-3.0, -6.0])  # 1 + ½·2 − 5; 1 − ½·8 − 3


def test_sarsa_error_does_not_depend_on_the_next_action_after_termination():
    q_tm1, a_tm1, r_t, q_t = jnp.array([[5.0, 9.0]]), jnp.array([0]), jnp.ones(1), jnp.ones((1, 2))
    for a_t in (0, 1):
        delta = sarsa_error(q_tm1, a_tm1, r_t, jnp.zeros(1), 100 * q_t, jnp.array([a_t]))
        assert_allclose(delta, [-4.0])  # 1 − 5


# --- λ-returns ---

DECOY = 1e6  # a value that must not be looked at


def returns_of(r_t, discount_t, best_t, truncated, trace_decay) -> list[float]:
    """λ-returns of one environment."""
    columns = [jnp.array(row, float)[:, None] for row in (r_t, discount_t, best_t, truncated)]
    returns = lambda_returns(*columns, trace_decay)
    assert returns.shape == (len(r_t), 1)
    return np.asarray(returns)[:, 0].tolist()


def test_a_lambda_of_zero_looks_one_step_ahead():
    returns = returns_of([1, 2, 4], [0.5] * 3, [10, 20, 8], [0, 0, 0], 0.0)
    assert_allclose(returns, [6, 12, 8])  # 1 + ½·10, 2 + ½·20, 4 + ½·8


def test_a_lambda_of_one_looks_to_the_end_of_the_rollout_and_bootstraps_there():
    returns = returns_of([1, 2, 4], [0.5] * 3, [DECOY, DECOY, 8], [0, 0, 0], 1.0)
    assert_allclose(returns, [4, 6, 8])  # 1 + ½·6, 2 + ½·8, 4 + ½·8


def test_a_lambda_between_mixes_what_follows_with_the_best_value():
    returns = returns_of([1, 2, 4], [0.5] * 3, [11, 20, 8], [0, 0, 0], 0.5)
    assert_allclose(returns, [6, 9, 8])  # 1 + ½·(9 + 11)/2, 2 + ½·(8 + 20)/2, 4 + ½·8


@pytest.mark.parametrize("trace_decay", [0.0, 0.5, 1.0])
def test_nothing_after_termination_is_part_of_the_return(trace_decay: float):
    returns = returns_of([DECOY, 2, 4], [0.5, 0, 0.5], [0, DECOY, 8], [0, 0, 0], trace_decay)
    assert_allclose(returns[1:], [2, 8])


def test_an_episode_cut_off_bootstraps_there_and_its_successor_is_not_looked_at():
    returns = returns_of([1, 2, DECOY], [0.5] * 3, [DECOY, 20, 8], [0, 1, 0], 1.0)
    assert_allclose(returns[:2], [7, 12])  # 1 + ½·12, 2 + ½·20


def test_lambda_returns_are_a_loop_over_steps_and_environments():
    rng = default_rng(0)
    r_t, best_t = rng.normal(size=(2, 9, 5))
    discount_t = rng.choice([0.0, 0.9], (9, 5), p=[0.3, 0.7])
    truncated = rng.choice([0.0, 1.0], (9, 5), p=[0.7, 0.3])
    slow = np.zeros((9, 5))
    for n in range(5):
        for t in reversed(range(9)):
            goes_on = t + 1 < 9 and not truncated[t, n]
            ahead = 0.7 * slow[t + 1, n] + 0.3 * best_t[t, n] if goes_on else best_t[t, n]
            slow[t, n] = r_t[t, n] + discount_t[t, n] * ahead
    assert_allclose(lambda_returns(r_t, discount_t, best_t, truncated, 0.7), slow, rtol=1e-5)
