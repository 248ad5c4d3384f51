import pytest

from touchdown.stats.spending import obrien_fleming


def test_the_levels_add_up_and_grow():
    levels = obrien_fleming([10, 20, 40, 80])
    assert sum(levels) == pytest.approx(0.05)
    assert levels == sorted(levels)
    assert sum(obrien_fleming([30], 0.01)) == pytest.approx(0.01)


def test_two_looks_of_equal_size_have_the_published_levels():
    first, last = obrien_fleming([30, 60])
    assert first == pytest.approx(0.0056, abs=5e-5)  # Lan & DeMets (1983), t = 0.5
    assert last == pytest.approx(0.05 - first)
