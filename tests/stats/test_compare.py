import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from touchdown.stats.compare import compare, holm

pytestmark = pytest.mark.usefixtures("without_collecting")


def test_winning_every_pair_is_a_certain_improvement():
    found = compare([1, 2, 3], [11, 12, 13])
    assert found.difference.value == 10
    assert found.probability_of_improvement.value == 1
    # three seeds on one side of a point, by chance, on either side
    assert found.p_value == 2 / 2**3
    assert (found.difference.low, found.difference.high) == (-math.inf, math.inf)


def test_ties_count_half():
    # of 2 × 2 pairs one is won, two are ties, one is lost
    assert compare([1, 2], [1, 2]).probability_of_improvement.value == 0.5
    # 3 beats 1 and 2, 2 beats 1 and ties with 2: 3.5 of 4
    assert compare([1, 2], [2, 3]).probability_of_improvement.value == 3.5 / 4


def test_swapping_the_sides_negates_the_comparison():
    rng = np.random.default_rng(0)
    one, other = rng.normal(size=9), rng.normal(0.5, 2, size=12)
    ab, ba = compare(one, other), compare(other, one)
    assert_allclose(ab.difference.low, -ba.difference.high)
    assert_allclose(ab.probability_of_improvement.value, 1 - ba.probability_of_improvement.value)
    assert_allclose(ab.p_value, ba.p_value)


def test_a_failure_hardly_changes_the_difference():
    base, other = np.linspace(200, 220, 10), np.linspace(240, 260, 10)
    before = compare(base, other).difference
    other[0] = -579
    after = compare(base, other).difference
    assert before.value == pytest.approx(40)
    assert abs(after.value - before.value) < 4
    assert after.low > 0


def test_groups_without_variance_are_equal_or_as_certain_as_their_number():
    assert compare([5, 5], [5, 5]).p_value == 1
    assert compare([5] * 6, [6] * 6).p_value == 2 / 2**6


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
