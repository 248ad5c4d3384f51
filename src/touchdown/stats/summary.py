"""Statistics of a set of episodes: location, spread, tail and outcomes."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike

from touchdown.core.types import FloatArray

OUTCOMES = ("landed", "crashed", "out of bounds", "timed out", "terminated")
RESAMPLES = 2_000


@dataclass(frozen=True, slots=True)
class Interval:
    """A point estimate and its 95% bootstrap interval."""

    value: float
    low: float
    high: float


_STORED = {"mean_return": "mean", "sd_return": "sd", "worst_5_percent": "worst"}  # in records


class Summary(Struct, frozen=True, kw_only=True, rename=_STORED):
    """Summary of a set of episodes; returns, fuel and threshold are in return points."""

    episodes: int
    mean_return: float
    sd_return: float
    iqm: Interval
    threshold: float | None
    """Return that an episode must reach to count as solved; None if the environment names none."""
    share_solved: float | None
    """Share of episodes whose return reaches the threshold."""
    outcomes: dict[str, float]
    """Share of episodes with each outcome that occurred."""
    steps: float
    fuel: float
    worst_5_percent: float
    """Mean of the worst 5% of returns (at least one episode)."""

    def to_json(self) -> dict[str, Any]:
        """As a JSON object."""
        return msgspec.to_builtins(self)


def interquartile_mean(values: ArrayLike, axis: int = -1) -> FloatArray:
    """Interquartile mean: mean of the middle half of the values.

    The same as `scipy.stats.trim_mean(values, 0.25)`, whose import takes longer than many test
    episodes.
    """
    sample = np.moveaxis(np.asarray(values, float), axis, -1)
    n = sample.shape[-1]
    cut = n // 4
    ordered = np.partition(sample, (cut, n - cut - 1), axis=-1)
    return ordered[..., cut : n - cut].mean(axis=-1)


def bootstrap_iqm(values: Sequence[float], seed: int = 0) -> Interval:
    """Interquartile mean with its 95% percentile bootstrap interval.

    The same as `scipy.stats.bootstrap` with `method="percentile"`, without its import.

    Args:
        values: at least one value.
        seed: seed of the resampling, so that results repeat.

    Raises:
        ValueError: there are no values.
    """
    if not len(values):
        raise ValueError("an interval needs at least one value")
    sample = np.asarray(values, float)
    value = float(interquartile_mean(sample))
    if np.ptp(sample) == 0:
        return Interval(value, value, value)
    drawn = np.random.default_rng(seed).integers(len(sample), size=(RESAMPLES, len(sample)))
    low, high = np.quantile(interquartile_mean(sample[drawn]), (0.025, 0.975))
    return Interval(value, float(low), float(high))


def summarise(
    returns: Sequence[float],
    steps: Sequence[int],
    outcomes: Sequence[str],
    fuel: Sequence[float],
    threshold: float | None,
) -> Summary:
    """Summarise a set of episodes; each sequence has one entry per episode.

    Raises:
        ValueError: there are no episodes.
    """
    iqm = bootstrap_iqm(returns)
    count = len(returns)
    worst = np.sort(returns)[: max(1, round(0.05 * count))]
    counts = Counter(outcomes)
    return Summary(
        episodes=count,
        mean_return=float(np.mean(returns)),
        sd_return=float(np.std(returns, ddof=1)) if count > 1 else 0.0,
        iqm=iqm,
        threshold=threshold,
        share_solved=None
        if threshold is None
        else float(np.mean(np.asarray(returns) >= threshold)),
        outcomes={name: counts[name] / count for name in OUTCOMES if counts[name]},
        steps=float(np.mean(steps)),
        fuel=float(np.mean(fuel)),
        worst_5_percent=float(np.mean(worst)),
    )
