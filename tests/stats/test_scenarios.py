import numpy as np
import pytest
from numpy.testing import assert_allclose

from touchdown.stats import scenarios
from touchdown.stats.location import trimmed_mean
from touchdown.stats.pairs import share_of_pairs
from touchdown.stats.scenarios import SCENARIOS, parameter_of, shift_to_equal, truth_of


def drawn(scenario, size, seed=5):
    rng = np.random.default_rng(seed)
    return scenario.one(rng, (size,)), scenario.other(rng, (size,))


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda each: each.name)
def test_the_shift_makes_each_win_half_of_all_pairs(scenario):
    one, other = drawn(scenario, 5_000)
    other = other + shift_to_equal(scenario, "pairs")
    assert_allclose(share_of_pairs(one, other), 0.5, atol=0.02)


def test_the_shift_makes_a_parameter_of_both_equal():
    failing = next(each for each in SCENARIOS if each.name == "20% fail")
    one, other = drawn(failing, 200_000)
    # 80% at 240, 20% at -100, against 240
    assert_allclose(shift_to_equal(failing, "mean"), 0.2 * 340, atol=1)
    shifted = other + shift_to_equal(failing, "trimmed mean")
    assert_allclose(trimmed_mean(one).value, trimmed_mean(shifted).value, atol=0.5)


def test_the_truth_is_the_parameter_of_many_draws():
    for scenario in SCENARIOS:
        _, other = drawn(scenario, 50_000)
        for name in ("median", "failures"):
            assert_allclose(parameter_of(other, name), truth_of(scenario.other, name), atol=4)
    assert parameter_of(np.array([99.9, 100, 240, 0]), "failures") == 0.5
    assert scenarios.FAILED_BELOW == 100
