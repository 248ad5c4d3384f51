"""Refuses weights with numbers that are not finite, which a diverged training leaves."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


def complaint(weights: Mapping[str, NDArray[Any]]) -> str | None:
    """What is wrong with the numbers of named arrays; None if all are finite."""
    for name, array in weights.items():
        if array.dtype.kind not in "fc":
            continue
        finite = np.isfinite(array)
        if not finite.all():
            count = int(array.size - np.count_nonzero(finite))
            return f"{name} has {count} of {array.size} numbers that are not finite"
    return None


def check(weights: Mapping[str, NDArray[Any]]) -> None:
    """Check named arrays.

    Raises:
        ValueError: a number is not finite.
    """
    if said := complaint(weights):
        raise ValueError(said)
