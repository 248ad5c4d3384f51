import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats

from touchdown.stats.pairs import most_pairs, share_of_pairs, typical_difference

pytestmark = pytest.mark.usefixtures("without_collecting")


def test_the_test_is_brunner_and_munzels_of_scipy():
    rng = np.random.default_rng(0)
    for _ in range(20):
        one, other = rng.normal(size=9), rng.normal(0.4, 3, size=12).round(1)
        for side, alternative in (("above", "greater"), ("below", "less")):
            twin = stats.brunnermunzel(one, other, alternative=alternative)
            found = getattr(most_pairs(one, other), side)
            assert_allclose(found, max(twin.pvalue, 2.0**-9), rtol=1e-9)


def test_settings_that_do_not_overlap_are_as_certain_as_coin_tosses():
    found = most_pairs([1, 2, 3, 4, 5, 6], [11, 12, 13, 14, 15, 16, 17])
    assert (found.above, found.below) == (1, 2.0**-6)
    assert most_pairs([5, 5, 5], [5, 5, 5]) == (0.5, 0.5)
    assert most_pairs([5, 5, 5], [5, 5, 5], shift=1).below == 2.0**-3


def test_never_is_longer_than_any_time_and_ties_with_never():
    never = math.inf
    assert share_of_pairs([never, never], [1, never]) == (2 + 0.5 * 2) / 4
    found = most_pairs([never] * 8, [1, 2, 3, 4, 5, 6, 7, never], shift=10)
    assert found.above < 0.01


def test_a_batch_is_compared_row_by_row():
    rng = np.random.default_rng(0)
    one, other = rng.normal(size=(5, 8)), rng.normal(size=(5, 6))
    rows = [most_pairs(a, b, 0.2).above for a, b in zip(one, other, strict=True)]
    assert_allclose(most_pairs(one, other, 0.2).above, rows)


def test_the_typical_difference_is_the_median_over_pairs():
    found = typical_difference([11, 12, 13], [1, 2, 3])
    assert found.value == 10
    # three seeds are too few for a confidence of 95%
    assert (found.low, found.high) == (-math.inf, math.inf)


@given(st.integers(0, 10_000), st.integers(7, 12), st.floats(0.5, 0.99))
def test_the_interval_has_the_shifts_that_the_test_does_not_reject(seed, n, confidence):
    rng = np.random.default_rng(seed)
    one, other = rng.normal(size=n), 2 * rng.normal(size=n + 1)
    found = typical_difference(one, other, confidence)
    level = (1 - confidence) / 2
    assert found.low <= found.value <= found.high
    for end, side, outwards in ((found.low, "above", -1), (found.high, "below", 1)):
        if math.isfinite(end):
            assert getattr(most_pairs(one, other, end + outwards * 1e-7), side) <= level
            inside = getattr(most_pairs(one, other, end - outwards * 1e-7), side)
            assert inside > level or found.value == end


def test_two_failures_of_ten_do_not_hide_a_better_setting():
    rng = np.random.default_rng(0)
    better, steady = rng.normal(270, 10, size=10), rng.normal(230, 10, size=10)
    better[:2] = (-57, -579)
    assert most_pairs(better, steady).above < 0.03
    assert better.mean() < steady.mean()
