"""Typical values that failed runs do not move far: medians and trimmed means, with intervals.

Arrays may have leading axes, one for each simulated data set; the last axis is the seeds.
"""

import math
import warnings
from typing import Any, NamedTuple, cast

import numpy as np
import scipy
from numpy.typing import ArrayLike

from touchdown.core.types import FloatArray
from touchdown.stats.seeds import checked
from touchdown.stats.summary import Interval

TRIM = 0.2
"""Share of the values that a trimmed mean leaves out at each end."""


class OneSided(NamedTuple):
    """Two one-sided p-values about the same number."""

    above: FloatArray
    """Small if the parameter is above the number."""
    below: FloatArray
    """Small if the parameter is below the number."""


def sign_test(values: ArrayLike, number: float) -> OneSided:
    """Whether most values are above, or below, a number: the sign test.

    It is exact for values of any distribution. Ties with the number count against both sides.

    Args:
        values: [..., n], one number per seed.
        number: the number to compare with.

    Returns:
        P-values, [...]. The null hypotheses are that at most half of all values are above, or
        below, the number.
    """
    sample = np.asarray(values, float)
    n = sample.shape[-1]
    above = (sample > number).sum(axis=-1)
    below = (sample < number).sum(axis=-1)
    tail = scipy.stats.binom.sf(np.arange(-1, n), n, 0.5)
    return OneSided(tail[above], tail[below])


def median_interval(values: ArrayLike, confidence: float = 0.95) -> Interval:
    """The median with its interval by order statistics, which is exact for any distribution.

    Args:
        values: [n], at least one; ∞ is allowed.
        confidence: least probability that the interval contains the median of all seeds.

    Returns:
        The interval; an end is infinite where n is too small for it (n < 6 at 95%).

    Raises:
        ValueError: there are no values, or one is NaN.
    """
    ordered = np.sort(np.asarray(values, float))
    n = len(ordered)
    if not n or np.isnan(ordered).any():
        raise ValueError(f"needs at least one value and no NaN, got {ordered.tolist()}")
    upper, lower = float(ordered[n // 2]), float(ordered[(n - 1) // 2])
    middle = upper if math.isinf(upper) else (upper + lower) / 2
    k = order_statistic(n, confidence)
    if k < 1:
        return Interval(middle, -math.inf, math.inf)
    return Interval(middle, float(ordered[k - 1]), float(ordered[n - k]))


def order_statistic(n: int, confidence: float = 0.95) -> int:
    """The rank, from 1, of the value that is the lower end of the median's interval; 0 if none is.

    It is the largest k with P(fewer than k of n values are below the median) ≤ (1 − confidence)/2.
    """
    return int(np.sum(scipy.stats.binom.cdf(np.arange(n), n, 0.5) <= (1 - confidence) / 2))


def trimmed_mean(values: ArrayLike, confidence: float = 0.95) -> Interval:
    """The mean without the lowest and highest `TRIM`, with Tukey and McLaughlin's interval (1963).

    The interval is Student's t on the winsorised variance; `touchdown study check` shows where it
    keeps its confidence.

    Args:
        values: [n], at least one.
        confidence: nominal confidence of the interval.

    Raises:
        ValueError: there are no values, or one is not finite.
    """
    sample = checked(values)
    half = float(trimmed_half_width(sample, confidence)) if len(sample) > 1 else 0.0
    middle = float(scipy.stats.trim_mean(sample, TRIM))
    return Interval(middle, middle - half, middle + half)


def trimmed_half_width(values: FloatArray, confidence: float = 0.95) -> FloatArray:
    """Half the width of the trimmed mean's interval, [...], from values, [..., n], n > 1."""
    n = values.shape[-1]
    cut = int(TRIM * n)
    ordered = np.sort(values, axis=-1)
    winsorised = np.clip(ordered, ordered[..., [cut]], ordered[..., [n - cut - 1]])
    kept = n - 2 * cut
    error = winsorised.std(axis=-1, ddof=1) * math.sqrt(n - 1) / math.sqrt(kept * (kept - 1))
    t = float(scipy.stats.t.ppf((1 + confidence) / 2, kept - 1))
    return cast(FloatArray, t * error)


def yuen(one: ArrayLike, other: ArrayLike) -> OneSided:
    """Whether a trimmed mean is above, or below, another: Yuen's test (1974), in SciPy.

    Args:
        one: [..., n], one number per seed.
        other: [..., m], likewise.

    Returns:
        P-values, [...], about the first trimmed mean minus the second, against 0.
    """
    with warnings.catch_warnings():
        # what is left without variance is equal, or certainly different
        warnings.simplefilter("ignore", RuntimeWarning)
        found: Any = scipy.stats.ttest_ind(
            one, other, axis=-1, equal_var=False, trim=TRIM, alternative="greater"
        )
    above = np.nan_to_num(np.asarray(found.pvalue, float), nan=0.5)
    return OneSided(above, 1 - above)
