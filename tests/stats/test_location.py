import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from touchdown.stats.location import (
    median_interval,
    order_statistic,
    sign_test,
    trimmed_half_width,
    trimmed_mean,
    yuen,
)


def test_the_sign_test_counts_coin_tosses():
    found = sign_test([1, 2, 3, 4, -1, 0], 0)
    # four of six above; the tie at 0 is on neither side
    assert_allclose(found.above, (15 + 6 + 1) / 64)
    assert_allclose(found.below, (64 - 1) / 64)
    for row, values in enumerate(np.random.default_rng(0).normal(size=(5, 7))):
        above = int((values > 0.3).sum())
        assert_allclose(
            sign_test(values, 0.3).above,
            stats.binomtest(above, 7, alternative="greater").pvalue,
            err_msg=str(row),
        )


def test_a_batch_is_tested_row_by_row():
    batch = np.random.default_rng(1).normal(size=(4, 9))
    assert_allclose(sign_test(batch, 0.1).below, [sign_test(row, 0.1).below for row in batch])
    other = batch[:, ::-1] ** 2
    rows = [yuen(a, b).above for a, b in zip(batch, other, strict=True)]
    assert_allclose(yuen(batch, other).above, rows)


def test_the_interval_of_a_median_is_its_order_statistics():
    # of six values, the lowest is above the median once in 64, and so is the highest below it
    six = median_interval([6, 1, 5, 2, 4, 3])
    assert (six.value, six.low, six.high) == (3.5, 1, 6)
    five = median_interval([1, 2, 3, 4, 1e9])
    assert (five.value, five.low, five.high) == (3, -math.inf, math.inf)
    assert order_statistic(100) == 40
    # two failures of ten do not move it out of the successes
    many = median_interval([-500, -100, *range(230, 238)])
    assert (many.value, many.low, many.high) == (232.5, -100, 236)


def test_a_median_may_be_never():
    found = median_interval([1, 2, 3, math.inf, math.inf, math.inf, math.inf])
    assert (found.value, found.low, found.high) == (math.inf, 1, math.inf)
    with pytest.raises(ValueError, match="no NaN"):
        median_interval([1, math.nan])


def test_the_intervals_of_a_median_cover_it_whatever_the_distribution():
    rng = np.random.default_rng(0)
    for draw in (rng.standard_cauchy, rng.normal):
        found = [median_interval(draw(size=12)) for _ in range(1_000)]
        assert np.mean([each.low <= 0 <= each.high for each in found]) > 0.94


def test_a_trimmed_mean_leaves_out_a_fifth_at_each_end():
    found = trimmed_mean([-1000, 1, 2, 3, 1000])
    assert found.value == 2
    # winsorised: 1 1 2 3 3, with the variance 1; h = 3 are kept
    error = math.sqrt(1 * 4 / (3 * 2))
    assert_allclose(found.high - 2, stats.t.ppf(0.975, 2) * error)
    assert trimmed_mean([7]).high == 7
    batch = np.random.default_rng(0).normal(size=(3, 11))
    rows = [trimmed_half_width(row) for row in batch]
    assert_allclose(trimmed_half_width(batch), rows)


def test_yuen_ignores_one_failure_of_ten_that_welch_does_not():
    rng = np.random.default_rng(0)
    good, better = rng.normal(220, 5, size=10), rng.normal(240, 5, size=10)
    better[0] = -500
    assert yuen(better, good).above < 0.001
    assert stats.ttest_ind(better, good, equal_var=False, alternative="greater").pvalue > 0.5
    assert_allclose(sum(yuen(better, good)), 1)
