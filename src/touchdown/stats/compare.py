"""One setting beside another, over training seeds, and how many more seeds would tell."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from statsmodels.stats import multitest
from statsmodels.stats.power import TTestIndPower, TTestPower

from touchdown.core.types import FloatArray
from touchdown.stats.seeds import checked, mean_interval, standard_error
from touchdown.stats.summary import RESAMPLES, Interval

ALPHA = 0.05
POWER = 0.8
MOST_SEEDS_NEEDED = 1_000
"""Nobody runs more than these: a difference that needs more counts as one that cannot be found."""
# noise that a machine's rounding makes of equal numbers
_NOTHING = 1e-9


@dataclass(frozen=True, slots=True)
class Comparison:
    """The seeds of another setting beside those of a base."""

    n_base: int
    n_other: int
    difference: Interval
    """Mean of the other less that of the base, with Welch's 95% interval."""
    probability_of_improvement: Interval
    """That a seed of the other is above one of the base, ties half, with its 95% bootstrap
    interval, seeds resampled on each side (Agarwal et al., 2021)."""
    p_value: float
    """Two-sided, by Welch's t: three seeds a side permute in 20 ways only, and a permutation test
    could not get below 0.1."""
    effect: float
    """The difference in standard deviations (Cohen, 1988); infinite where no seed varies."""

    def seeds_needed(self, alpha: float = ALPHA) -> int | None:
        """Seeds a side that find such a difference four times in five.

        None if they are more than `MOST_SEEDS_NEEDED`.

        Args:
            alpha: what the p-value must be below.
        """
        return _seeds_for(TTestIndPower(), self.effect, alpha)


def compare(base: ArrayLike, other: ArrayLike, seed: int = 0) -> Comparison:
    """Compare two settings.

    Args:
        base: [n], a number a seed, at least two.
        other: [m], as well.
        seed: of the resampling.

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
        # seeds that all agree on one side are no loss of precision: the other side has the variance
        warnings.simplefilter("ignore", RuntimeWarning)
        result: Any = stats.ttest_ind(b, a, equal_var=False)
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


def _seeds_for(test: Any, effect: float, alpha: float) -> int | None:
    """Seeds a side for `POWER` at alpha; None where there is no effect, or more are needed."""
    if math.isinf(effect):
        return 2
    if abs(effect) < _NOTHING:
        return None
    if test.power(effect, MOST_SEEDS_NEEDED, alpha) < POWER:
        return None
    counts = np.arange(2, MOST_SEEDS_NEEDED + 1)
    enough = cast(FloatArray, test.power(effect, counts, alpha)) >= POWER
    return int(counts[np.argmax(enough)])


def holm(p_values: Sequence[float]) -> list[float]:
    """P-values corrected so that one in twenty families errs, not one in twenty tests (Holm, 1979).

    Args:
        p_values: of one family; none are fine.
    """
    if not p_values:
        return []
    adjust = cast(Any, multitest).multipletests
    return [float(p) for p in adjust(list(p_values), alpha=ALPHA, method="holm")[1]]


@dataclass(frozen=True, slots=True)
class Trend:
    """Whether numbers rise or fall from level to level."""

    tau: float
    """Kendall's τ-b between a seed's number and the rank of its level: 1 always rises."""
    p_value: float
    """Two-sided."""
    seeds: float
    """A level, on average."""

    def seeds_needed(self, alpha: float = ALPHA) -> int | None:
        """Seeds a level that find such a τ four times in five; None above the same number.

        Args:
            alpha: what the p-value must be below.
        """
        # the statistic's z grows with the root of the seeds
        seen = float(stats.norm.isf(max(self.p_value, 1e-300) / 2))
        wanted = float(stats.norm.isf(alpha / 2) + stats.norm.isf(1 - POWER))
        if seen <= 0:
            return None
        needed = math.ceil(self.seeds * (wanted / seen) ** 2)
        return max(2, needed) if needed <= MOST_SEEDS_NEEDED else None


def trend(groups: Sequence[ArrayLike]) -> Trend:
    """Kendall's rank correlation of numbers with the order of their levels (Kendall, 1938).

    Args:
        groups: the seeds' numbers of each level, in the levels' order; two levels or more.

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
    result: Any = stats.kendalltau(ranks, values)
    return Trend(float(result.statistic), float(result.pvalue), seeds)


def best_of(groups: Sequence[ArrayLike], seed: int = 0) -> list[float]:
    """How often each level has the greatest mean when seeds are resampled; ties share. Sums to 1.

    The mean of three seeds resampled varies less than a mean of three does, so each is spread by
    √(n / (n − 1)) about its level's mean.

    Args:
        groups: the seeds' numbers of each level, at least two each.
        seed: of the resampling.

    Raises:
        ValueError: there are no levels, too few seeds, or a number is not finite.
    """
    samples = [checked(group, 2) for group in groups]
    if not samples:
        raise ValueError("the best of no levels is none")
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
    """Where a mean is, beside a number that was given before."""

    mean: Interval
    """With its 95% interval by Student's t."""
    p_above: float
    """One-sided: small where the mean is above the number."""
    p_below: float
    """One-sided: small where it is below."""
    effect: float
    """How far above, in standard deviations; infinite where no seed varies."""

    def seeds_needed(self, alpha: float = ALPHA) -> int | None:
        """Seeds that find such a distance four times in five; None above `MOST_SEEDS_NEEDED`.

        Args:
            alpha: what the two-sided p-value must be below.
        """
        return _seeds_for(TTestPower(), self.effect, alpha)


def margin(values: ArrayLike, threshold: float) -> Margin:
    """Is the mean above a number, or below it? Student's t.

    Args:
        values: [n], a number a seed, at least two.
        threshold: the number.

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
    above: Any = stats.ttest_1samp(sample, threshold, alternative="greater")
    spread = float(np.std(sample, ddof=1))
    return Margin(
        mean,
        float(above.pvalue),
        1.0 - float(above.pvalue),
        distance / spread,
    )
