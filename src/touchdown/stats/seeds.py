"""Statistics over training seeds: the unit is the seed, never the pooled episode."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
import scipy
from numpy.typing import ArrayLike

from touchdown.core.types import FloatArray
from touchdown.stats.summary import Interval, bootstrap_iqm

BAND_CONTENT = 0.8
"""Fraction of all seeds that the band should contain."""
BAND_CONFIDENCE = 0.9
"""Probability that the band contains that fraction."""
_FEWEST_FOR_BAND = 3  # with two seeds the band would be twenty times as wide as their distance


@dataclass(frozen=True, slots=True)
class SeedSummary:
    """Summary of n training seeds of one setting."""

    n: int
    mean: Interval
    """Mean with its 95% interval, by Student's t."""
    iqm: Interval
    """Interquartile mean with its 95% percentile bootstrap interval (Agarwal et al., 2021). The
    bootstrap never draws a seed worse than the worst observed one, so for normal data it covers
    only about 77% at n = 3, 85% at 5 and 91% at 10, while Student's t covers 95%."""
    band: tuple[float, float] | None
    """Range that contains `BAND_CONTENT` of all seeds with probability `BAND_CONFIDENCE`; None with
    fewer than three seeds."""
    values: tuple[float, ...]


def summarise_seeds(values: ArrayLike) -> SeedSummary:
    """Summarise one number per seed.

    Args:
        values: [n], one number per seed, at least one.

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
    """Values as an array, [n], after checking them.

    Args:
        values: [n].
        fewest: minimum number of values.

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
    """The mean with its 95% interval, by Student's t; for one value, just that value.

    Args:
        values: [n], at least one.

    Raises:
        ValueError: there are no values, or one is not finite.
    """
    sample = checked(values)
    mean = float(sample.mean())
    if len(sample) < 2:
        return Interval(mean, mean, mean)
    half = float(scipy.stats.t.ppf(0.975, len(sample) - 1)) * standard_error(sample)
    return Interval(mean, mean - half, mean + half)


def standard_error(values: FloatArray) -> float:
    """Standard error of the mean of at least two values."""
    return float(np.std(values, ddof=1)) / len(values) ** 0.5


def tolerance_band(
    values: Sequence[float] | FloatArray,
    content: float = BAND_CONTENT,
    confidence: float = BAND_CONFIDENCE,
) -> tuple[float, float] | None:
    """Two-sided normal tolerance interval, with Howe's factor (Howe, 1969).

    It bounds individual future seeds, not their mean, so more seeds do not shrink it to zero.

    Args:
        values: [n], one number per seed.
        content: fraction of all seeds that it should contain.
        confidence: probability that the interval contains that fraction.

    Returns:
        Its two ends; None with fewer than three values.

    Raises:
        ValueError: a value is not finite.
    """
    sample = checked(values)
    n = len(sample)
    if n < _FEWEST_FOR_BAND:
        return None
    z = float(scipy.stats.norm.ppf((1 + content) / 2))
    spread = float(scipy.stats.chi2.ppf(1 - confidence, n - 1))
    half = z * ((n - 1) * (1 + 1 / n) / spread) ** 0.5 * float(np.std(sample, ddof=1))
    mean = float(cast(float, sample.mean()))
    return mean - half, mean + half
