import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.random import default_rng

from touchdown.replay.sum_tree import SumTree


@given(
    size=st.integers(1, 40),
    changes=st.lists(st.tuples(st.integers(0, 39), st.sampled_from([0.0, 0.1, 1.0, 7.0]))),
    seed=st.integers(0, 99),
)
def test_a_tree_finds_what_a_running_sum_finds(size: int, changes: list, seed: int):
    tree, twin = SumTree(size), np.zeros(size)
    for index, value in changes:
        tree.set(np.array([index % size]), np.array([value]))
        twin[index % size] = value
    np.testing.assert_array_equal(tree.values, twin)
    assert tree.total == pytest.approx(twin.sum())
    if tree.total == 0:
        return
    sums = default_rng(seed).random(20) * tree.total
    found = tree.find(sums)
    assert (twin[found] > 0).all()  # what has no chance is never drawn
    running = twin.cumsum()
    for place, wanted in zip(found, sums, strict=True):
        assert running[place] - twin[place] <= wanted + 1e-12
        assert wanted <= running[place] + 1e-12


def test_one_number_is_changed_as_many_are():
    alone, together = SumTree(11), SumTree(11)
    for index, value in [(0, 0.1), (10, 0.7), (3, 0.3), (10, 0.2)]:
        alone.set_one(index, value)
        together.set(np.array([index]), np.array([value]))
        np.testing.assert_array_equal(alone.values, together.values)
        assert alone.total == together.total


def test_the_first_and_the_last_are_found_at_the_borders_of_the_sum():
    tree = SumTree(3)
    tree.set(np.arange(3), np.array([2.0, 0.0, 3.0]))
    assert tree.find(np.array([0.0, 1.999, 2.0, 4.999])).tolist() == [0, 0, 2, 2]


def test_of_one_index_given_twice_the_last_value_counts():
    tree = SumTree(5)
    tree.set(np.array([4, 1, 4]), np.array([9.0, 1.0, 2.0]))
    assert tree.values.tolist() == [0, 1, 0, 0, 2]
    assert tree.total == 3


def test_rounding_does_not_gather():
    tree, rng = SumTree(1_000), default_rng(0)
    for _ in range(300):
        tree.set(rng.integers(0, 1_000, 64), rng.random(64) ** 9)
    tree.set(np.arange(1_000), np.full(1_000, 0.25))
    assert tree.total == 250


def test_a_tree_of_nothing_is_refused():
    with pytest.raises(ValueError, match="size must be at least 1"):
        SumTree(0)
