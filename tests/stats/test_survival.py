import math

import pytest
from numpy.testing import assert_allclose
from scipy import stats

from touchdown.stats.survival import kaplan_meier, log_rank

NEVER = math.inf


def test_a_seed_that_never_reached_it_stays_at_risk_until_its_end():
    # at 10 one of four reaches it; one leaves at 15; at 20 one of the two left reaches it
    found = kaplan_meier([10, NEVER, 20, NEVER], [40, 15, 40, 40])
    assert found.times == (10, 20)
    assert_allclose(found.shares, (3 / 4, 3 / 4 * 1 / 2))
    assert found.median == 20
    assert all(
        low <= s <= high for low, s, high in zip(found.low, found.shares, found.high, strict=True)
    )


def test_seeds_that_never_reach_it_have_no_median():
    assert kaplan_meier([NEVER] * 3, [9] * 3).median == NEVER
    assert kaplan_meier([5, NEVER, NEVER], [9] * 3).median == NEVER


def test_the_log_rank_test_compares_seen_with_expected():
    # two against two, all in turn: at 1, 2, 3, 4 the slower side has 2/4, 2/3, 1, 1 expected
    found = log_rank([3, 4], [9, 9], [1, 2], [9, 9])
    expected = 2 / 4 + 2 / 3 + 1 + 1
    variance = 1 / 4 + 2 / 9
    assert_allclose(found.above, stats.norm.sf((expected - 2) / variance**0.5))
    assert_allclose(sum(found), 1)
    assert_allclose(log_rank([1, 2], [9, 9], [3, 4], [9, 9]).below, found.above)


def test_nothing_that_happens_decides_nothing():
    assert log_rank([NEVER], [9], [NEVER], [9]) == (1, 1)
    with pytest.raises(ValueError, match="after the end"):
        kaplan_meier([10], [9])
    with pytest.raises(ValueError, match="need as many ends"):
        kaplan_meier([10], [])
