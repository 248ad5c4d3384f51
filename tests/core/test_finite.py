import numpy as np
import pytest

from touchdown.core import finite


def test_the_first_array_with_numbers_that_are_not_finite_is_named():
    weights = {
        "count": np.array([1, 2]),
        "good": np.ones(2, np.float32),
        "bad": np.array([[1, np.nan], [-np.inf, 0]]),
        "worse": np.full(2, np.nan),
    }
    said = "bad has 2 of 4 numbers that are not finite"
    assert finite.complaint(weights) == said
    with pytest.raises(ValueError, match=said):
        finite.check(weights)


def test_finite_arrays_and_arrays_of_other_kinds_pass():
    weights = {"w": np.zeros((0, 2)), "n": np.array([2**62]), "t": np.array(["nan"])}
    assert finite.complaint(weights) is None
    finite.check(weights)
