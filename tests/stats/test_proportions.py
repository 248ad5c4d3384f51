import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from touchdown.stats.proportions import (
    clopper_pearson,
    failures,
    fewer_failures,
    fisher,
    share_margin,
    wilson,
)


def test_a_run_below_the_threshold_has_failed():
    found = failures([240, -57, 100, 99.9], 100)
    assert (found.n, found.failed, found.share.value) == (4, 2, 0.5)
    assert found.of_others == (240, 100)
    with pytest.raises(ValueError, match="at least one value"):
        failures([], 0)


def test_wilsons_interval_is_that_of_scipy_and_never_leaves_0_to_1():
    for n in (1, 5, 20):
        low, high = wilson(np.arange(n + 1), n)
        for k in range(n + 1):
            twin = stats.binomtest(k, n).proportion_ci(0.95, method="wilson")
            assert_allclose((low[k], high[k]), twin, atol=1e-12)
    # no failure of ten: z² / (n + z²)
    assert_allclose(wilson(0, 10), (0, 1.96**2 / (10 + 1.96**2)), rtol=1e-4)


def test_the_exact_interval_is_that_of_scipy():
    for n in (1, 5, 20):
        low, high = clopper_pearson(np.arange(n + 1), n)
        for k in range(n + 1):
            twin = stats.binomtest(k, n).proportion_ci(0.95, method="exact")
            assert_allclose((low[k], high[k]), twin, atol=1e-9)
    # no failure of ten: the largest p with (1 − p)^10 ≥ 2.5%
    assert_allclose(failures([1] * 10, 0).share.high, 1 - 0.025 ** (1 / 10))


def test_failing_less_often_is_above():
    found = fewer_failures([240] * 8, [0] * 8, 100, 0.15)
    assert found.zero.above < 0.001
    assert found.margin.above < 0.001
    assert found.negative.below > 0.99
    assert fewer_failures([[240], [0]], [[0], [0]], 100, 0.15).zero.above.tolist() == [0.5, 1]


def test_fishers_test_is_that_of_scipy():
    for k in range(8):
        found = fisher(k, 7, 2, 6)
        table = [[k, 7 - k], [2, 4]]
        assert_allclose(found.above, stats.fisher_exact(table, alternative="greater").pvalue)
        assert_allclose(found.below, stats.fisher_exact(table, alternative="less").pvalue)


def test_three_failures_of_three_against_none_is_one_of_twenty_ways():
    assert_allclose(fisher(3, 3, 0, 3).above, 1 / 20)
    assert_allclose(fisher([3, 0], 3, [0, 3], 3).below, [1, 1 / 20])


def test_a_margin_between_shares_seldom_errs():
    rng = np.random.default_rng(0)
    for n in (20, 50):
        ours, theirs = rng.binomial(n, 0.3, 20_000), rng.binomial(n, 0.1, 20_000)
        found = share_margin(ours, n, theirs, n, 0.2)
        assert np.mean(found.above < 0.025) < 0.033
        assert np.mean(found.below < 0.025) < 0.033


def test_a_margin_of_nothing_between_equal_shares_is_in_the_middle():
    assert_allclose(share_margin(3, 10, 3, 10, 0.0), (0.5, 0.5))
    wide = share_margin(0, 100, 0, 100, 0.15)
    assert wide.below < 0.001
    assert_allclose(sum(wide), 1)
