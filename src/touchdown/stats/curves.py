"""Numbers of a learning curve: the area under it, and when it first reached a threshold."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from touchdown.core.types import FloatArray


def area_under(env_steps: Sequence[float], returns: Sequence[float], until: float) -> float:
    """Mean return over environment steps from 0 to `until`, by the trapezoidal rule.

    The curve is constant before the first validation and after the last one.

    Args:
        env_steps: environment steps of each validation, in increasing order.
        returns: mean return of each validation.
        until: end of the interval in environment steps, above 0.

    Raises:
        ValueError: there are no validations, the lengths differ, or `until` is not above 0.
    """
    at, values = _curve(env_steps, returns)
    if until <= 0:
        raise ValueError(f"until = {until}: must be above 0")
    inside = (at > 0) & (at < until)
    points = np.concatenate(([0.0], at[inside], [until]))
    return float(np.trapezoid(np.interp(points, at, values), points)) / until


def first_reaching(env_steps: Sequence[float], returns: Sequence[float], threshold: float) -> float:
    """Environment steps at the first validation that reached the threshold; ∞ if none did.

    Raises:
        ValueError: there are no validations, or the lengths differ.
    """
    at, values = _curve(env_steps, returns)
    reached = np.flatnonzero(values >= threshold)
    return float(at[reached[0]]) if len(reached) else math.inf


def _curve(env_steps: Sequence[float], returns: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    at, values = np.asarray(env_steps, float), np.asarray(returns, float)
    if not len(at) or at.shape != values.shape:
        raise ValueError(f"{len(at)} validations need as many returns, got {len(values)}")
    return at, values


@dataclass(frozen=True, slots=True)
class Reached:
    """When seeds reached a threshold, if at all."""

    n: int
    reached: int
    """Number of seeds that reached it."""
    median: float
    """∞ if at least half of the seeds never reached it, so the median is unknown."""
    low: float
    """`low` and `high`: interval of the median by order statistics, at least 95% for n ≥ 6; with
    fewer seeds, the range of all of them."""
    high: float


def reached(times: Sequence[float]) -> Reached:
    """The median of times, some of which may be ∞ for seeds that never reached the threshold.

    Seeds that did not reach it were observed at least as long as those that did, so order
    statistics are valid for these right-censored times.

    Args:
        times: one per seed, at least one.

    Raises:
        ValueError: there are no times, or one is NaN.
    """
    ordered = np.sort(np.asarray(times, float))
    n = len(ordered)
    if not n or np.isnan(ordered).any():
        raise ValueError(f"needs at least one time and no NaN, got {list(times)}")
    # the largest k with P(fewer than k of n are below the median) ≤ 2.5%
    k = int(scipy.stats.binom.ppf(0.025, n, 0.5))
    low, high = (0, n - 1) if k < 1 else (k - 1, n - k)
    upper, lower = float(ordered[n // 2]), float(ordered[(n - 1) // 2])
    return Reached(
        n,
        int(np.isfinite(ordered).sum()),
        upper if math.isinf(upper) else (upper + lower) / 2,
        float(ordered[low]),
        float(ordered[high]),
    )
