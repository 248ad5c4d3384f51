"""Compares settings over training seeds, and computes how many seeds a test needs."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
import scipy
from numpy.typing import ArrayLike

from touchdown.core.types import FloatArray
from touchdown.stats.seeds import checked, mean_interval, standard_error
from touchdown.stats.summary import RESAMPLES, Interval

ALPHA = 0.05
POWER = 0.8
MOST_SEEDS_NEEDED = 1_000
"""Largest realistic number of seeds; a difference that needs more counts as undetectable."""
# rounding makes equal numbers differ by less than this
_NOTHING = 1e-9


@dataclass(frozen=True, slots=True)
class Comparison:
    """Comparison of another setting's seeds with those of a baseline setting."""

    n_base: int
    n_other: int
    difference: Interval
    """Mean of the other setting minus that of the base, with Welch's 95% interval."""
    probability_of_improvement: Interval
    """Probability of improvement: that a seed of the other exceeds one of the base, ties counting
    half, with its 95% bootstrap interval over the seeds of both (Agarwal et al., 2021)."""
    p_value: float
    """Two-sided, by Welch's t-test. Three seeds per side have only 20 permutations, so a
    permutation test could not go below 0.1."""
    effect: float
    """Effect size: difference in standard deviations (Cohen, 1988); infinite without variance."""

    def seeds_needed(self, alpha: float = ALPHA) -> int | None:
        """Seeds per side to detect it with power 0.8; None above `MOST_SEEDS_NEEDED`.

        Args:
            alpha: significance level.
        """
        return _seeds_for(self.effect, alpha, samples=2)


def compare(base: ArrayLike, other: ArrayLike, seed: int = 0) -> Comparison:
    """Compare two settings.

    Args:
        base: [n], one number per seed, at least two.
        other: [m], likewise.
        seed: seed of the resampling.

    Raises:
        ValueError: there are too few values, or one is not finite.
    """
    a, b = checked(base, 2), checked(other, 2)
    difference = float(b.mean() - a.mean())
    improvement = _improvement(a, b, seed)
    pooled = math.sqrt((float(np.var(a, ddof=1)) + float(np.var(b, ddof=1))) / 2)
    if pooled <= _NOTHING * max(1.0, abs(difference)):
        same = abs(difference) <= _NOTHING
        return Comparison(
            len(a),
            len(b),
            Interval(difference, difference, difference),
            improvement,
            1.0 if same else 0.0,
            0.0 if same else math.copysign(math.inf, difference),
        )
    with warnings.catch_warnings():
        # equal seeds on one side warn of lost precision, but the other side has variance
        warnings.simplefilter("ignore", RuntimeWarning)
        result: Any = scipy.stats.ttest_ind(b, a, equal_var=False)
        interval = result.confidence_interval(0.95)
    return Comparison(
        len(a),
        len(b),
        Interval(difference, float(interval.low), float(interval.high)),
        improvement,
        float(result.pvalue),
        difference / pooled,
    )


def _improvement(base: FloatArray, other: FloatArray, seed: int) -> Interval:
    """P(other > base) + ½ P(other = base)."""
    wins = (np.sign(other[:, None] - base[None, :]) + 1) / 2
    value = float(wins.mean())
    rng = np.random.default_rng(seed)
    rows = rng.integers(len(other), size=(RESAMPLES, len(other), 1))
    columns = rng.integers(len(base), size=(RESAMPLES, 1, len(base)))
    resampled = wins[rows, columns].mean(axis=(1, 2))
    low, high = np.quantile(resampled, [0.025, 0.975])
    return Interval(value, float(low), float(high))


def _seeds_for(effect: float, alpha: float, *, samples: Literal[1, 2]) -> int | None:
    """Seeds per side for `POWER` at alpha; None without an effect, or above `MOST_SEEDS_NEEDED`."""
    from statsmodels.stats import power  # noqa: PLC0415 - loads pandas, a second

    if math.isinf(effect):
        return 2
    if abs(effect) < _NOTHING:
        return None
    test: Any = power.TTestPower() if samples == 1 else power.TTestIndPower()
    if test.power(effect, MOST_SEEDS_NEEDED, alpha) < POWER:
        return None
    counts = np.arange(2, MOST_SEEDS_NEEDED + 1)
    enough = cast(FloatArray, test.power(effect, counts, alpha)) >= POWER
    return int(counts[np.argmax(enough)])


def holm(p_values: Sequence[float]) -> list[float]:
    """P-values corrected for the family-wise error rate (Holm, 1979).

    Args:
        p_values: p-values of one family of tests; may be empty.
    """
    if not p_values:
        return []
    from statsmodels.stats import multitest  # noqa: PLC0415 - loads pandas, a second

    adjust = cast(Any, multitest).multipletests
    return [float(p) for p in adjust(list(p_values), alpha=ALPHA, method="holm")[1]]


@dataclass(frozen=True, slots=True)
class Trend:
    """Whether numbers increase or decrease with the level."""

    tau: float
    """Kendall's τ-b between a seed's number and the rank of its level; 1 if it always increases."""
    p_value: float
    """Two-sided."""
    seeds: float
    """Seeds per level, on average."""

    def seeds_needed(self, alpha: float = ALPHA) -> int | None:
        """Seeds per level to detect this τ with power 0.8; None above `MOST_SEEDS_NEEDED`.

        Args:
            alpha: significance level.
        """
        # the z-score of the statistic grows with the square root of the number of seeds
        seen = float(scipy.stats.norm.isf(max(self.p_value, 1e-300) / 2))
        wanted = float(scipy.stats.norm.isf(alpha / 2) + scipy.stats.norm.isf(1 - POWER))
        if seen <= 0:
            return None
        needed = math.ceil(self.seeds * (wanted / seen) ** 2)
        return max(2, needed) if needed <= MOST_SEEDS_NEEDED else None


def trend(groups: Sequence[ArrayLike]) -> Trend:
    """Kendall's rank correlation of numbers with the order of their levels (Kendall, 1938).

    Args:
        groups: the numbers of each level, one per seed, in the order of the levels; at least two
            levels.

    Raises:
        ValueError: there are fewer levels, a level has no seed, or a number is not finite.
    """
    if len(groups) < 2:
        raise ValueError(f"a trend needs at least 2 levels, got {len(groups)}")
    samples = [checked(group) for group in groups]
    ranks = np.repeat(np.arange(len(samples)), [len(sample) for sample in samples])
    values = np.concatenate(samples)
    seeds = len(values) / len(samples)
    if np.ptp(values) == 0:
        return Trend(0.0, 1.0, seeds)
    result: Any = scipy.stats.kendalltau(ranks, values)
    return Trend(float(result.statistic), float(result.pvalue), seeds)


def best_of(groups: Sequence[ArrayLike], seed: int = 0) -> list[float]:
    """How often each level has the largest mean when seeds are resampled; ties share. Sums to 1.

    Resampled means of n seeds vary too little, by a factor √((n − 1) / n), so their deviations from
    the mean of the level are scaled by √(n / (n − 1)).

    Args:
        groups: the numbers of each level, one per seed, at least two each.
        seed: seed of the resampling.

    Raises:
        ValueError: there are no levels, too few seeds, or a number is not finite.
    """
    samples = [checked(group, 2) for group in groups]
    if not samples:
        raise ValueError("best_of: needs at least one level")
    rng = np.random.default_rng(seed)
    means = np.empty((len(samples), RESAMPLES))
    for row, sample in zip(means, samples, strict=True):
        n = len(sample)
        drawn = sample[rng.integers(n, size=(RESAMPLES, n))].mean(axis=1)
        row[:] = sample.mean() + (drawn - sample.mean()) * math.sqrt(n / (n - 1))
    is_best = means == means.max(axis=0)
    return [float(share) for share in (is_best / is_best.sum(axis=0)).mean(axis=1)]


@dataclass(frozen=True, slots=True)
class Margin:
    """Comparison of a mean with a threshold fixed in advance."""

    mean: Interval
    """Mean with its 95% interval, by Student's t."""
    p_above: float
    """One-sided: small if the mean is above the threshold."""
    p_below: float
    """One-sided: small if the mean is below the threshold."""
    effect: float
    """Distance above the threshold in standard deviations; infinite without variance."""

    def seeds_needed(self, alpha: float = ALPHA) -> int | None:
        """Seeds to detect this distance with power 0.8; None above `MOST_SEEDS_NEEDED`.

        Args:
            alpha: significance level of the two-sided test.
        """
        return _seeds_for(self.effect, alpha, samples=1)


def margin(values: ArrayLike, threshold: float) -> Margin:
    """Test whether a mean is above or below a threshold, by Student's t-test.

    Args:
        values: [n], one number per seed, at least two.
        threshold: the threshold to compare with.

    Raises:
        ValueError: there are too few values, or one is not finite.
    """
    sample = checked(values, 2)
    mean = mean_interval(sample)
    distance = mean.value - threshold
    if standard_error(sample) <= _NOTHING:
        sides = (
            (0.5, 0.5) if abs(distance) <= _NOTHING else (float(distance < 0), float(distance > 0))
        )
        effect = 0.0 if abs(distance) <= _NOTHING else math.copysign(math.inf, distance)
        return Margin(mean, *sides, effect)
    above: Any = scipy.stats.ttest_1samp(sample, threshold, alternative="greater")
    spread = float(np.std(sample, ddof=1))
    return Margin(
        mean,
        float(above.pvalue),
        1.0 - float(above.pvalue),
        distance / spread,
    )
