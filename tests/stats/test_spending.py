import math

import pytest

from touchdown.stats import spending


def test_the_levels_add_up_and_grow():
    levels = spending.levels([10, 20, 40, 80])
    assert sum(levels) == pytest.approx(0.05)
    assert levels == sorted(levels)
    assert sum(spending.levels([30], alpha=0.01)) == pytest.approx(0.01)


def test_two_looks_of_equal_size_have_the_published_levels():
    first, last = spending.levels([30, 60])
    assert first == pytest.approx(0.0056, abs=5e-5)  # Lan & DeMets (1983), t = 0.5
    assert last == pytest.approx(0.05 - first)


def test_pocock_gives_early_looks_more():
    first, second, third = spending.levels([30, 60, 120], spending.POCOCK)
    assert first + second + third == pytest.approx(0.05)
    assert first == pytest.approx(0.05 * math.log(1 + (math.e - 1) / 4))  # Lan & DeMets (1983)
    assert first > 100 * spending.levels([30, 60, 120])[0]


def test_an_unknown_shape_is_refused():
    with pytest.raises(ValueError, match=r"'flat': must be one of obrien-fleming, pocock"):
        spending.levels([10, 20], "flat")
