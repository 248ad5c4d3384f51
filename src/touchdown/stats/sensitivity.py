"""How much an algorithm depends on its settings, across environments (Adkins et al., 2024)."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from touchdown.core.types import FloatArray

FEWEST_SEEDS = 2
"""One seed is scored with the settings that the others choose, so it takes two."""
_LOW, _HIGH = 5, 95  # percentiles of an environment's scores that become 0 and 1
_NEARLY = 0.95  # share of the best score at which tuning more settings no longer matters


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """The numbers of one algorithm, as normalised scores."""

    tuned: FloatArray
    """[S] Score of each seed with the best settings for each environment, mean over those."""
    shared: FloatArray
    """[S] The same with one choice of settings for all environments, the best on average."""
    best: tuple[int, ...]
    """[E] The best settings for each environment, by all seeds."""
    best_shared: int
    """The best settings for all environments, by all seeds."""
    dimensionality: int
    """How many settings must be tuned per environment for 95% of the score that tuning all gives,
    while the others are the shared ones; by all seeds, so that it tends to be too high."""

    @property
    def sensitivity(self) -> float:
        """What tuning per environment gains over shared settings."""
        return float(np.mean(self.tuned - self.shared))


def normalised(scores: FloatArray) -> FloatArray:
    """Scores of each environment on a scale of their own: its 5th percentile is 0, its 95th is 1.

    Args:
        scores: [A, E, H, S], of algorithms, environments, settings and seeds. The percentiles are
            of the means over seeds, of all algorithms and settings.

    Returns:
        [A, E, H, S]; an environment whose scores are all the same has 0.
    """
    means = scores.mean(axis=3)
    low, high = (np.percentile(means, at, axis=(0, 2))[None, :, None, None] for at in (_LOW, _HIGH))
    spread = high - low
    return np.where(spread > 0, (scores - low) / np.where(spread > 0, spread, 1.0), 0.0)


def sensitivity_of(scores: FloatArray, settings: Sequence[Sequence[object]]) -> Sensitivity:
    """The sensitivity of one algorithm to its settings.

    Adkins, Bowling & White (2024) compare the best settings for each environment with the best
    settings for all. The mean of the best of many noisy scores is too high. So each seed is scored
    here with the settings that are the best for the other seeds.

    Args:
        scores: [E, H, S], normalised; S is at least `FEWEST_SEEDS`.
        settings: [H][K], the K values of each choice of settings.
    """
    of_others = (scores.sum(axis=2, keepdims=True) - scores) / (scores.shape[2] - 1)  # [E, H, S]
    per_environment = of_others.argmax(axis=1)  # [E, S]
    for_all = of_others.mean(axis=0).argmax(axis=0)  # [S]
    tuned = np.take_along_axis(scores, per_environment[:, None], axis=1)[:, 0].mean(axis=0)
    shared = np.take_along_axis(scores, for_all[None, None], axis=1)[:, 0].mean(axis=0)
    means = scores.mean(axis=2)  # [E, H]
    best_shared = int(means.mean(axis=0).argmax())
    return Sensitivity(
        tuned=tuned,
        shared=shared,
        best=tuple(means.argmax(axis=1).tolist()),
        best_shared=best_shared,
        dimensionality=_dimensionality(means, settings, best_shared),
    )


def _dimensionality(
    means: FloatArray, settings: Sequence[Sequence[object]], best_shared: int
) -> int:
    """The fewest settings whose tuning per environment gives nearly the best score."""
    fixed = settings[best_shared]
    best = float(means.max(axis=1).mean())
    wanted = best - (1.0 - _NEARLY) * abs(best)
    places = range(len(fixed))
    for count in places:
        for tuned in combinations(places, count):
            rest = [place for place in places if place not in tuned]
            allowed = [all(of[place] == fixed[place] for place in rest) for of in settings]
            if means[:, allowed].max(axis=1).mean() >= wanted:
                return count
    return len(fixed)
