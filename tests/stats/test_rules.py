import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from touchdown.stats import rules
from touchdown.stats.location import OneSided
from touchdown.stats.rules import (
    EXCEEDS,
    FAILS,
    HOLDS,
    NO_DIFFERENCE,
    UNDECIDED,
    Sides,
    best,
    beyond,
    higher,
    monotone,
    near,
    within,
)


def about(difference, error=1.0, margin=20.0):
    """P-values of a normal difference with a known standard error."""

    def against(number):
        z = (np.asarray(difference, float) - number) / error
        return OneSided(stats.norm.sf(z), stats.norm.cdf(z))

    return Sides(against(0), against(margin), against(-margin))


LEVEL = 0.025


@pytest.mark.parametrize(
    ("difference", "error", "code"),
    [
        (50, 5, HOLDS),
        (15, 5, HOLDS),  # above 0, and perhaps by more than 20
        (5, 5, NO_DIFFERENCE),
        (5, 1, NO_DIFFERENCE),  # above 0, but by less than matters
        (-5, 1, NO_DIFFERENCE),
        (-15, 5, FAILS),
        (-50, 5, FAILS),
        (0, 15, UNDECIDED),
        (-25, 20, UNDECIDED),  # a rise of 20 is excluded, but neither a fall nor no difference
        (30, 20, UNDECIDED),
    ],
)
def test_a_difference_is_a_rise_a_fall_or_none_that_matters(difference, error, code):
    found = higher([about(difference, error)], LEVEL)
    assert found.codes == code
    # it is undecided at all levels below the smallest
    assert higher([about(difference, error)], 0.49 * found.p_value).codes == UNDECIDED


def test_better_in_one_part_and_worse_in_none_is_better():
    better, same, worse, unknown = about(50), about(0), about(-50), about(0, 100)
    assert higher([better, same], LEVEL).codes == HOLDS
    assert higher([better, unknown], LEVEL).codes == HOLDS
    assert higher([better, worse], LEVEL).codes == UNDECIDED
    assert higher([worse, same], LEVEL).codes == FAILS
    assert higher([same, same], LEVEL).codes == NO_DIFFERENCE
    assert higher([same, unknown], LEVEL).codes == UNDECIDED


def test_two_parts_are_tested_at_half_the_level():
    barely, unknown = about(2.1, 1.0, 20), about(0, 100)
    # p = 0.018, but neither shown to matter nor not to: the margin is far away
    close = barely._replace(margin=OneSided(np.array(0.5), np.array(0.5)))
    assert higher([close], LEVEL).codes == HOLDS
    assert higher([close, unknown], LEVEL).codes == UNDECIDED


def test_within_a_margin_holds_and_outside_fails():
    assert [within([about(d, 5)], LEVEL).codes for d in (0, 50, -50, 20)] == [
        HOLDS,
        FAILS,
        FAILS,
        UNDECIDED,
    ]


def test_a_number_may_be_reached_and_exceeded():
    low, high = about(0).zero, about(-40).zero
    assert near(low=about(20).zero, high=about(-20).zero, level=LEVEL, exceeds=True).codes == HOLDS
    assert near(about(-9).zero, about(-49).zero, LEVEL, exceeds=True).codes == FAILS
    assert near(about(49).zero, about(9).zero, LEVEL, exceeds=True).codes == EXCEEDS
    assert near(about(49).zero, about(9).zero, LEVEL, exceeds=False).codes == FAILS
    assert near(low, high, LEVEL, exceeds=True).codes == UNDECIDED


def test_a_value_is_beyond_a_number_or_not():
    assert [beyond(about(d).zero, LEVEL).codes for d in (9, -9, 1)] == [HOLDS, FAILS, UNDECIDED]


def pairs_of(means, error):
    """Sides of all ordered pairs of levels, and of the ends."""
    count = len(means)
    pairs = [about(means[j] - means[i], error) for i in range(count) for j in range(i + 1, count)]
    return pairs, about(means[-1] - means[0], error)


@pytest.mark.parametrize(
    ("means", "code"),
    [
        ((0, 50, 100, 150), HOLDS),
        ((0, 245, 245, 245), HOLDS),  # a plateau is no fall
        ((0, 245, 235, 225, 215), FAILS),  # a jump, then a decline
        ((0, 50, 100, 0), FAILS),
        ((100, 102, 99, 101), NO_DIFFERENCE),
        ((150, 100, 50, 0), FAILS),
    ],
)
def test_more_is_better_if_the_ends_rise_and_no_pair_falls(means, code):
    assert monotone(*pairs_of(means, 3), LEVEL).codes == code
    assert monotone(*pairs_of(means, 300), LEVEL).codes == UNDECIDED


def against(ours, others, error):
    return [[about(mean - other, error) for mean in ours] for other in others]


@pytest.mark.parametrize(
    ("ours", "others", "code"),
    [
        ((100,), (0, 50), HOLDS),
        ((100,), (0, 150), FAILS),
        ((100,), (0, 101), NO_DIFFERENCE),
        ((0, 100), (50, 20), HOLDS),
        ((0, 100), (150, 20), FAILS),
        ((0, 100), (99, 20), NO_DIFFERENCE),
    ],
)
def test_the_best_is_above_all_others(ours, others, code):
    assert best(against(ours, others, 3), LEVEL).codes == code
    assert best(against(ours, others, 300), LEVEL).codes == UNDECIDED


def test_rules_err_as_seldom_as_their_level_says():
    draws = np.random.default_rng(0).normal(size=(5, 20_000))
    # errors of independent means are those of a difference, divided by √2
    means, error = draws * 10 / 2**0.5, 10.0
    found = higher([about(means[1] - means[0], error)], LEVEL).codes
    assert np.mean(found == HOLDS) < 0.03
    assert np.mean(found == FAILS) < 0.03
    tied = best(against(means[:1], means[1:], error), LEVEL).codes
    assert np.mean(tied == HOLDS) < 0.03
    assert np.mean(tied == FAILS) < 0.03
    flat = monotone(*pairs_of(list(means), error), LEVEL).codes
    assert np.mean(flat == HOLDS) < 0.03
    assert np.mean(flat == FAILS) < 0.03


def test_the_same_about_minus_the_difference():
    assert_allclose(about(7).swapped, about(-7))
    assert rules.within([about(7, 9).swapped], 0.3).p_value == pytest.approx(
        rules.within([about(7, 9)], 0.3).p_value
    )
