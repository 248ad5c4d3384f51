"""Compares two settings over all pairs of their seeds: in most pairs, which one has more?

The parameter is θ = P(one > other + shift) + ½ P(one = other + shift), against one half. A
failed run loses its pairs, but how low its return is makes no difference. So the test keeps its
error rate on bimodal returns, where a comparison of means does not (`touchdown study check`).
"""

import bisect
import math
from collections.abc import Callable, Sequence
from typing import cast

import numpy as np
import scipy
from numpy.typing import ArrayLike

from touchdown.core.types import FloatArray
from touchdown.stats.location import OneSided
from touchdown.stats.rules import Sides
from touchdown.stats.seeds import checked
from touchdown.stats.summary import Interval


def most_pairs(one: ArrayLike, other: ArrayLike, shift: float = 0.0) -> OneSided:
    """Whether one setting has more than another in most pairs of seeds (Brunner & Munzel, 2000).

    A p-value is at least ½ⁿ, where n is the smaller number of seeds: the probability that chance
    alone puts all n on one side of their own median, where the other setting's seeds may all be.
    Without this limit, settings that do not overlap would have a p-value of 0.

    Args:
        one: [..., n], one number per seed, at least two; ∞ is allowed.
        other: [..., m], likewise.
        shift: number that is added to the other.

    Returns:
        P-values, [...], about θ against one half.
    """
    a, b = np.asarray(one, float)[..., :, None], np.asarray(other, float)[..., None, :] + shift
    n, m = a.shape[-2], b.shape[-1]
    signs = (a > b).astype(np.int8) - (a < b)
    of_a = (signs.sum(axis=-1, dtype=np.int32) / m + 1) / 2  # share of pairs that a seed wins
    of_b = (1 - signs.sum(axis=-2, dtype=np.int32) / n) / 2
    theta = of_a.mean(axis=-1)
    spread_a, spread_b = of_a.var(axis=-1, ddof=1) / n, of_b.var(axis=-1, ddof=1) / m
    spread = spread_a + spread_b
    exact = spread < 1e-12  # rounding makes equal shares differ by less than this
    safe = np.where(exact, 1.0, spread)
    degrees = np.where(
        exact, 1.0, safe**2 / np.where(exact, 1.0, spread_a**2 / (n - 1) + spread_b**2 / (m - 1))
    )
    distance = cast(FloatArray, np.around(theta - 0.5, 9))
    certain = np.where(distance == 0, 0.0, np.copysign(math.inf, distance))
    t = np.where(exact, certain, (theta - 0.5) / np.sqrt(safe))
    least = 2.0 ** -min(n, m)
    above, below = scipy.stats.t.sf(t, degrees), scipy.stats.t.cdf(t, degrees)
    return OneSided(np.maximum(above, least), np.maximum(below, least))


def sides(one: ArrayLike, other: ArrayLike, margin: float) -> Sides:
    """The tests of `most_pairs` against 0 and against both ends of ±margin.

    Args:
        one: [..., n], one number per seed, at least two; ∞ is allowed.
        other: [..., m], likewise.
        margin: smallest effect of interest, above 0.
    """
    return Sides(*(most_pairs(one, other, shift) for shift in (0.0, margin, -margin)))


def sides_of_levels(levels: Sequence[ArrayLike], margin: float) -> tuple[list[Sides], Sides]:
    """The sides of each two of some ordered levels, the later minus the earlier, and of the ends.

    Args:
        levels: [..., n] for each level, in order; at least two.
        margin: smallest effect of interest, above 0.
    """
    found = {
        (i, j): sides(later, earlier, margin)
        for i, earlier in enumerate(levels)
        for j, later in enumerate(levels)
        if i < j
    }
    return list(found.values()), found[0, len(levels) - 1]


def share_of_pairs(one: ArrayLike, other: ArrayLike) -> float:
    """In what share of pairs of seeds the first has more than the second; ties count half.

    Args:
        one: [n], one number per seed, at least one; ∞ is allowed.
        other: [m], likewise.
    """
    a, b = np.asarray(one, float)[:, None], np.asarray(other, float)[None, :]
    return float(((a > b) + 0.5 * (a == b)).mean())


def typical_difference(one: ArrayLike, other: ArrayLike, confidence: float = 0.95) -> Interval:
    """The difference that half of all pairs exceed, with the interval of `most_pairs`.

    The estimate is Hodges and Lehmann's (1963), the median over pairs. The interval has each shift
    that `most_pairs` does not reject.

    Args:
        one: [n], one number per seed, at least two.
        other: [m], likewise.
        confidence: nominal confidence of the interval.

    Returns:
        The interval; an end is infinite where there are too few seeds for it.

    Raises:
        ValueError: there are too few values, or one is not finite.
    """
    a, b = checked(one, 2), checked(other, 2)
    differences = np.subtract.outer(a, b).ravel()
    value = float(np.median(differences))
    steps = np.unique(differences)
    # θ is constant between two neighbouring differences
    shifts = np.concatenate([[steps[0] - 1], (steps[1:] + steps[:-1]) / 2, [steps[-1] + 1]])
    level = (1 - confidence) / 2
    below_low = _first(shifts, lambda shift: float(most_pairs(a, b, shift).above) > level)
    from_high = _first(shifts, lambda shift: float(most_pairs(a, b, shift).below) <= level)
    low = float(steps[below_low - 1]) if below_low else -math.inf
    high = float(steps[from_high - 1]) if from_high < len(shifts) else math.inf
    return Interval(value, min(low, value), max(high, value))


def _first(shifts: FloatArray, is_true: Callable[[float], bool]) -> int:
    """The first index for which it is true, by bisection; all later ones are true, too."""
    return bisect.bisect_left(range(len(shifts)), 1, key=lambda i: int(is_true(float(shifts[i]))))
