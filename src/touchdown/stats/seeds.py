"""What a set of training seeds says: the seed is the unit, never the pooled episode."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from touchdown.core.types import FloatArray
from touchdown.stats.summary import Interval, bootstrap_iqm

BAND_CONTENT = 0.8
"""Share of all seeds that the band is to hold."""
BAND_CONFIDENCE = 0.9
"""How often a band holds that share."""
_FEWEST_FOR_BAND = 3  # of two seeds it would be twenty times as wide as they lie apart


@dataclass(frozen=True, slots=True)
class SeedSummary:
    """Numbers of n training seeds of one setting."""

    n: int
    mean: Interval
    """With its 95% interval by Student's t."""
    iqm: Interval
    """Interquartile mean with its 95% percentile bootstrap interval (Agarwal et al., 2021). It
    knows no seed worse than the worst seen: of normal numbers it covers some 77% at n = 3, 85% at
    5 and 91% at 10, where Student's t of the mean covers 95%."""
    band: tuple[float, float] | None
    """Where most other seeds would fall, `BAND_CONTENT` of them with `BAND_CONFIDENCE`; None of
    fewer than three seeds."""
    values: tuple[float, ...]


def summarise_seeds(values: ArrayLike) -> SeedSummary:
    """The numbers of a set of seeds.

    Args:
        values: [n], a number a seed, at least one.

    Raises:
        ValueError: there are no values, or one is not finite.
    """
    sample = checked(values)
    return SeedSummary(
        len(sample),
        mean_interval(sample),
        bootstrap_iqm(sample.tolist()),
        tolerance_band(sample),
        tuple(sample.tolist()),
    )


def checked(values: ArrayLike, fewest: int = 1) -> FloatArray:
    """Values as an array of numbers.

    Raises:
        ValueError: there are fewer, or one is not finite.
    """
    sample = np.asarray(values, float)
    if sample.ndim != 1 or len(sample) < fewest:
        raise ValueError(f"needs a list of at least {fewest} values, got shape {sample.shape}")
    if not np.isfinite(sample).all():
        raise ValueError(f"values must be finite, got {sample.tolist()}")
    return sample


def mean_interval(values: ArrayLike) -> Interval:
    """The mean with its 95% interval by Student's t; of one value that value alone.

    Args:
        values: [n], at least one.

    Raises:
        ValueError: there are no values, or one is not finite.
    """
    sample = checked(values)
    mean = float(sample.mean())
    if len(sample) < 2:
        return Interval(mean, mean, mean)
    half = float(stats.t.ppf(0.975, len(sample) - 1)) * standard_error(sample)
    return Interval(mean, mean - half, mean + half)


def standard_error(values: FloatArray) -> float:
    """Of the mean of at least two values."""
    return float(np.std(values, ddof=1)) / len(values) ** 0.5


def tolerance_band(
    values: Sequence[float] | FloatArray,
    content: float = BAND_CONTENT,
    confidence: float = BAND_CONFIDENCE,
) -> tuple[float, float] | None:
    """Normal two-sided tolerance interval by Howe's factor (Howe, 1969).

    It is of the next seeds, not of their mean, and does not shrink to nothing with more of them.

    Args:
        values: [n], a number a seed.
        content: share of all seeds that it is to hold.
        confidence: how often such an interval holds that share.

    Returns:
        Its ends; None of fewer than three values.

    Raises:
        ValueError: a value is not finite.
    """
    sample = checked(values)
    n = len(sample)
    if n < _FEWEST_FOR_BAND:
        return None
    z = float(stats.norm.ppf((1 + content) / 2))
    spread = float(stats.chi2.ppf(1 - confidence, n - 1))
    half = z * ((n - 1) * (1 + 1 / n) / spread) ** 0.5 * float(np.std(sample, ddof=1))
    mean = float(cast(float, sample.mean()))
    return mean - half, mean + half
