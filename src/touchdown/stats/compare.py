"""Compares two settings over training seeds, and corrects p-values for several tests."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from touchdown.core.types import FloatArray
from touchdown.stats import pairs
from touchdown.stats.seeds import checked
from touchdown.stats.summary import RESAMPLES, Interval

ALPHA = 0.05


@dataclass(frozen=True, slots=True)
class Comparison:
    """Comparison of another setting's seeds with those of a baseline setting."""

    n_base: int
    n_other: int
    difference: Interval
    """What a seed of the other has more than one of the base in half of all pairs, with the 95%
    interval of `pairs.typical_difference`; its ends are infinite with fewer than six seeds."""
    probability_of_improvement: Interval
    """Probability of improvement: that a seed of the other exceeds one of the base, ties counting
    half, with its 95% bootstrap interval over the seeds of both (Agarwal et al., 2021)."""
    p_value: float
    """Two-sided, by `pairs.most_pairs`; it keeps its error rate from ten seeds on."""


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
    found = pairs.most_pairs(b, a)
    return Comparison(
        len(a),
        len(b),
        pairs.typical_difference(b, a),
        _improvement(a, b, seed),
        min(1.0, 2 * float(min(found))),
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
