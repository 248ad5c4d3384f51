import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from touchdown.stats.curves import area_under, first_reaching, reached


def test_the_area_of_a_constant_curve_is_its_value():
    assert area_under([10, 20], [5, 5], until=40) == 5


def test_the_area_is_that_of_trapezoids():
    # 0 until 10, then a line up to 100 at 20: 0 · 10 + 50 · 10, over 20
    assert area_under([10, 20], [0, 100], until=20) == 25


def test_validations_after_the_end_do_not_count():
    # the line is at 50 where it is cut: 0 · 10 + 25 · 5, over 15
    assert_allclose(area_under([10, 20, 30], [0, 100, -9e9], until=15), 125 / 15)


def test_a_curve_is_refused_without_validations_or_an_end():
    with pytest.raises(ValueError, match="need as many"):
        area_under([], [], 1)
    with pytest.raises(ValueError, match="until = 0"):
        area_under([1], [1], 0)


def test_the_first_validation_at_the_threshold_counts():
    assert first_reaching([10, 20, 30], [199, 200, 250], 200) == 20
    assert first_reaching([10, 20], [0, 199.9], 200) == math.inf


def test_the_median_of_seeds_that_all_reached_the_threshold():
    found = reached([30, 10, 20])
    assert (found.n, found.reached, found.median) == (3, 3, 20)
    assert (found.low, found.high) == (10, 30)
    assert reached([10, 20]).median == 15


def test_the_median_is_unknown_if_half_never_reached_the_threshold():
    assert reached([10, math.inf]).median == math.inf
    assert reached([10, 20, math.inf]).median == 20
    assert reached([10, 20, math.inf]).reached == 2
    assert reached([math.inf]).reached == 0


def test_an_empty_list_of_times_is_refused():
    for times in ([], [math.nan]):
        with pytest.raises(ValueError, match="at least one time"):
            reached(times)


def test_the_interval_of_a_median_covers_it():
    rng = np.random.default_rng(0)
    found = [reached(rng.exponential(size=9).tolist()) for _ in range(1_000)]
    covered = np.mean([each.low <= math.log(2) <= each.high for each in found])
    assert covered > 0.94
