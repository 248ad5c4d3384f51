"""A run's learning curve in numbers: how much it was worth on the way, and when it got there."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from touchdown.core.types import FloatArray


def area_under(observations: Sequence[float], returns: Sequence[float], until: float) -> float:
    """Mean return over the observations from 0 to `until`, by trapezoids: what a run was worth.

    Before the first validation its value holds, after the last one that one's.

    Args:
        observations: of each validation, rising.
        returns: mean return of each.
        until: the last observation that counts, above 0.

    Raises:
        ValueError: there are no validations, they are not as many as returns, or `until` is not
            above 0.
    """
    at, values = _curve(observations, returns)
    if until <= 0:
        raise ValueError(f"until = {until}: must be above 0")
    inside = (at > 0) & (at < until)
    points = np.concatenate(([0.0], at[inside], [until]))
    return float(np.trapezoid(np.interp(points, at, values), points)) / until


def first_reaching(
    observations: Sequence[float], returns: Sequence[float], threshold: float
) -> float:
    """The observation of the first validation at the threshold or above; ∞ if there is none.

    Raises:
        ValueError: there are no validations, or they are not as many as returns.
    """
    at, values = _curve(observations, returns)
    reached = np.flatnonzero(values >= threshold)
    return float(at[reached[0]]) if len(reached) else math.inf


def _curve(
    observations: Sequence[float], returns: Sequence[float]
) -> tuple[FloatArray, FloatArray]:
    at, values = np.asarray(observations, float), np.asarray(returns, float)
    if not len(at) or at.shape != values.shape:
        raise ValueError(f"{len(at)} observations need as many returns, got {len(values)}")
    return at, values


@dataclass(frozen=True, slots=True)
class Reached:
    """When seeds got somewhere, if they did."""

    n: int
    reached: int
    """Those that got there."""
    median: float
    """∞ where half of them or more never got there: it is then not known."""
    low: float
    """The median's interval by order statistics, at least 95% where n is 6 or more; of fewer it
    is all that was seen."""
    high: float


def reached(times: Sequence[float]) -> Reached:
    """The median of times of which some are ∞, for seeds that never got there.

    All that did not get there had at least as long as those that did, so an order statistic is
    right whatever they would have done later.

    Args:
        times: of each seed, at least one.

    Raises:
        ValueError: there are none, or one is NaN.
    """
    ordered = np.sort(np.asarray(times, float))
    n = len(ordered)
    if not n or np.isnan(ordered).any():
        raise ValueError(f"needs at least one time and no NaN, got {list(times)}")
    # the greatest k with P(fewer than k of n are below the median) ≤ 2.5%
    k = int(stats.binom.ppf(0.025, n, 0.5))
    low, high = (0, n - 1) if k < 1 else (k - 1, n - k)
    upper, lower = float(ordered[n // 2]), float(ordered[(n - 1) // 2])
    return Reached(
        n,
        int(np.isfinite(ordered).sum()),
        upper if math.isinf(upper) else (upper + lower) / 2,
        float(ordered[low]),
        float(ordered[high]),
    )
