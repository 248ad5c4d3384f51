"""Shares of seeds, such as the probability that a run fails: intervals and comparisons.

Counts may be arrays, one entry for each simulated data set.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
import scipy
from numpy.typing import ArrayLike

from touchdown.core.types import FloatArray
from touchdown.stats.location import OneSided
from touchdown.stats.rules import Sides
from touchdown.stats.summary import Interval


@dataclass(frozen=True, slots=True)
class Failures:
    """How many runs failed: ended below a threshold that was named beforehand."""

    threshold: float
    n: int
    failed: int
    share: Interval
    """Share of failed runs, with its exact 95% interval."""
    of_others: tuple[float, ...]
    """The numbers of the runs that did not fail."""


def failures(values: ArrayLike, threshold: float) -> Failures:
    """Count the runs below a threshold.

    Args:
        values: [n], one number per seed, at least one.
        threshold: smallest number of a run that did not fail.

    Raises:
        ValueError: there are no values, or one is NaN.
    """
    sample = np.asarray(values, float)
    if sample.ndim != 1 or not len(sample) or np.isnan(sample).any():
        raise ValueError(f"needs at least one value and no NaN, got {sample.tolist()}")
    failed = int((sample < threshold).sum())
    low, high = clopper_pearson(failed, len(sample))
    share = Interval(failed / len(sample), float(low), float(high))
    others = tuple(sample[sample >= threshold].tolist())
    return Failures(threshold, len(sample), failed, share, others)


def wilson(count: ArrayLike, n: int, confidence: float = 0.95) -> tuple[FloatArray, FloatArray]:
    """Wilson's score interval of a probability (Wilson, 1927).

    For shares near 0, it covers less than it claims; `touchdown study check` shows how much.

    Args:
        count: how many of the n, [...].
        n: number of trials, at least 1.
        confidence: nominal confidence of the interval.

    Returns:
        Both ends, [...].
    """
    z = float(scipy.stats.norm.ppf((1 + confidence) / 2))
    share = np.asarray(count, float) / n
    middle = (share + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    low, high = np.maximum(0, middle - half), np.minimum(1, middle + half)
    return cast(FloatArray, np.where(share == 0, 0, low)), np.where(share == 1, 1, high)


def clopper_pearson(
    count: ArrayLike, n: int, confidence: float = 0.95
) -> tuple[FloatArray, FloatArray]:
    """The exact interval of a probability (Clopper & Pearson, 1934).

    Args:
        count: how many of the n, [...].
        n: number of trials, at least 1.
        confidence: least confidence of the interval.

    Returns:
        Both ends, [...].
    """
    k, tail = np.asarray(count, float), (1 - confidence) / 2
    of = scipy.stats.beta
    low = np.where(k == 0, 0.0, of.ppf(tail, np.maximum(k, 1), n - np.maximum(k, 1) + 1))
    high = np.where(k == n, 1.0, of.ppf(1 - tail, np.minimum(k, n - 1) + 1, np.maximum(n - k, 1)))
    return low, high


def fisher(count: ArrayLike, n: int, other: ArrayLike, m: int) -> OneSided:
    """Whether a probability is above, or below, another: Fisher's exact test (1935).

    Args:
        count: how many of the n, [...].
        n: number of trials of the first, at least 1.
        other: how many of the m, [...].
        m: number of trials of the second, at least 1.

    Returns:
        P-values, [...], about the first probability minus the second, against 0.
    """
    ours = np.asarray(count, int)
    both = ours + np.asarray(other, int)
    of = scipy.stats.hypergeom
    return OneSided(of.sf(ours - 1, n + m, both, n), of.cdf(ours, n + m, both, n))


def share_margin(count: ArrayLike, n: int, other: ArrayLike, m: int, difference: float) -> OneSided:
    """Whether two probabilities differ by more, or by less, than a number.

    The test is the normal one after one success and one failure are added to each side (Agresti &
    Caffo, 2000), which keeps its level at small n, also for shares of 0 and 1.

    Args:
        count: how many of the n, [...].
        n: number of trials of the first, at least 1.
        other: how many of the m, [...].
        m: number of trials of the second, at least 1.
        difference: the number, from -1 to 1.

    Returns:
        P-values, [...], about the first probability minus the second, against the number.
    """
    ours, theirs = (
        (np.asarray(count, float) + 1) / (n + 2),
        (np.asarray(other, float) + 1) / (m + 2),
    )
    error = np.sqrt(ours * (1 - ours) / (n + 2) + theirs * (1 - theirs) / (m + 2))
    z = (ours - theirs - difference) / error
    return OneSided(scipy.stats.norm.sf(z), scipy.stats.norm.cdf(z))


def fewer_failures(one: ArrayLike, other: ArrayLike, threshold: float, margin: float) -> Sides:
    """How much less often one setting fails than another: Fisher's test, and margins.

    Args:
        one: [..., n], one number per seed.
        other: [..., m], likewise.
        threshold: smallest number of a run that did not fail.
        margin: smallest difference of interest of the probabilities, from 0 to 1.

    Returns:
        P-values, [...], about the other's probability minus that of the one.
    """
    a, b = np.asarray(one, float) < threshold, np.asarray(other, float) < threshold
    counts = (b.sum(axis=-1), b.shape[-1], a.sum(axis=-1), a.shape[-1])
    return Sides(fisher(*counts), share_margin(*counts, margin), share_margin(*counts, -margin))
