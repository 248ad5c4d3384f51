import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats

from touchdown.stats.compare import MOST_SEEDS, best_of, compare, holm, margin, trend

pytestmark = pytest.mark.usefixtures("without_collecting")


def test_winning_every_pair_is_a_certain_improvement():
    found = compare([1, 2, 3], [11, 12, 13])
    assert found.difference.value == 10
    assert found.probability_of_improvement.value == 1
    # both variances 1: t = 10 / √(2/3), with 4 degrees of freedom
    assert_allclose(found.p_value, 2 * stats.t.sf(10 / (2 / 3) ** 0.5, 4), rtol=1e-9)


def test_ties_count_half():
    # of 2 × 2 pairs one is won, two are ties, one is lost
    assert compare([1, 2], [1, 2]).probability_of_improvement.value == 0.5
    # 3 beats 1 and 2, 2 beats 1 and ties with 2: 3.5 of 4
    assert compare([1, 2], [2, 3]).probability_of_improvement.value == 3.5 / 4


def test_swapping_the_sides_negates_the_comparison():
    one, other = [1.0, 4.0, 2.0], [3.0, 9.0, 5.0, 4.0]
    ab, ba = compare(one, other), compare(other, one)
    assert_allclose(ab.difference.low, -ba.difference.high)
    assert_allclose(ab.probability_of_improvement.value, 1 - ba.probability_of_improvement.value)
    assert ab.p_value == ba.p_value
    assert ab.seeds_needed() == ba.seeds_needed()
    assert ab.effect == -ba.effect


def test_groups_without_variance_are_equal_or_certainly_different():
    same, different = compare([5, 5], [5, 5]), compare([5, 5], [6, 6])
    assert (same.p_value, same.seeds_needed()) == (1, None)
    assert (different.p_value, different.seeds_needed()) == (0, 2)


def test_a_side_without_variance_is_compared_without_a_warning():
    found = compare([82.35, 82.35, 82.35], [210, 214, 218])
    # the base has no variance: Student's t of the other alone
    assert_allclose(found.p_value, stats.ttest_1samp([210, 214, 218], 82.35).pvalue, rtol=1e-6)


def test_a_tiny_difference_needs_too_many_seeds():
    rng = np.random.default_rng(0)
    sample = rng.normal(size=20)
    found = compare(sample, sample + 0.01)
    assert found.seeds_needed() is None
    assert compare(sample, sample + 1).seeds_needed() < MOST_SEEDS


def test_the_seeds_needed_detect_the_difference_four_times_in_five():
    rng = np.random.default_rng(0)
    base = stats.zscore(np.arange(6.0), ddof=1)
    needed = compare(base, base + 1).seeds_needed()
    # statsmodels and every table: 17 a side for an effect of 1
    assert needed == 17
    samples = rng.normal(size=(2, 2_000, needed))
    p = stats.ttest_ind(samples[0], samples[1] + 1, axis=1).pvalue
    assert abs(np.mean(p < 0.05) - 0.8) < 0.03


def test_a_stricter_test_needs_more_seeds():
    base = stats.zscore(np.arange(6.0), ddof=1)
    for found in (compare(base, base + 1), margin(base, 1), trend([base, base + 1])):
        assert found.seeds_needed(0.005) > found.seeds_needed(0.05)


def test_holm_multiplies_the_smallest_by_their_number():
    assert_allclose(holm([0.01, 0.04, 0.03]), [0.03, 0.06, 0.06])
    assert holm([]) == []


@given(st.lists(st.floats(0, 1), min_size=1, max_size=12))
def test_holm_makes_no_p_value_smaller(p_values):
    for raw, corrected in zip(p_values, holm(p_values), strict=True):
        assert raw - 1e-12 <= corrected <= 1


def test_holm_errs_in_one_family_of_twenty():
    p = np.random.default_rng(0).random((2_000, 6))
    wrong = np.mean([min(holm(list(family))) < 0.05 for family in p])
    assert wrong < 0.065


def test_numbers_that_rise_at_every_level_have_a_tau_near_one():
    rising = trend([[1, 2], [3, 4], [5, 6]])
    falling = trend([[5, 6], [3, 4], [1, 2]])
    # 12 of 15 pairs agree, 3 tie in the level: 12 / √(12 · 15)
    assert_allclose(rising.tau, 12 / (12 * 15) ** 0.5)
    assert falling.tau == -rising.tau
    assert rising.p_value == falling.p_value < 0.05


def test_constant_numbers_have_no_trend():
    assert trend([[3, 3], [3, 3]]) == trend([[1, 1], [1, 1], [1, 1]])
    assert trend([[3, 3], [3, 3]]).seeds_needed() is None
    with pytest.raises(ValueError, match="at least 2 levels"):
        trend([[1, 2]])


def test_a_weak_trend_needs_more_seeds():
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(4, 5))
    weak = trend(noise + 0.3 * np.arange(4)[:, None])
    strong = trend(noise + 2 * np.arange(4)[:, None])
    assert strong.seeds_needed() < weak.seeds_needed()


def test_the_best_of_levels_far_apart_is_always_the_same():
    assert best_of([[1, 2], [100, 101], [3, 4]]) == [0, 1, 0]


def test_levels_that_are_the_same_share_being_best():
    assert best_of([[5, 5], [5, 5], [1, 1]]) == [0.5, 0.5, 0]


def test_being_best_adds_up_to_one():
    rng = np.random.default_rng(0)
    assert_allclose(sum(best_of(rng.normal(size=(5, 3)))), 1)


def test_a_mean_of_three_is_resampled_as_widely_as_it_is_uncertain():
    # two levels of standard normals: one is best half of the time, over all data
    rng = np.random.default_rng(0)
    shares = [best_of(rng.normal(size=(2, 3)), seed=i)[0] for i in range(150)]
    # the share by chance at this level of certainty; t with 3 seeds has heavier tails
    sure = [max(share, 1 - share) > 0.95 for share in shares]
    assert np.mean(sure) < 0.2


def test_a_mean_is_above_or_below_a_number():
    found = margin([9, 10, 11], 0)
    # t = 10 √3
    assert_allclose(found.p_above, stats.t.sf(10 * 3**0.5, 2), rtol=1e-9)
    assert_allclose(found.p_above + found.p_below, 1)
    below = margin([9, 10, 11], 20)
    assert below.p_below < 0.01
    assert below.p_above > 0.99


def test_a_mean_without_variance_is_certain():
    assert margin([5, 5], 4).p_above == 0
    assert margin([5, 5], 4).p_below == 1
    assert margin([5, 5], 5).p_above == margin([5, 5], 5).p_below == 0.5
