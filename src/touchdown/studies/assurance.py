"""How likely a number of further seeds is to decide a claim, as far as the seeds so far tell."""

from collections.abc import Sequence

import numpy as np

from touchdown.core.types import FloatArray
from touchdown.stats.rules import UNDECIDED
from touchdown.studies.claim_tests import Test

FURTHER_SEEDS = (5, 10, 20, 40, 80, 160)
"""Numbers of further seeds that are tried."""
ASSURANCE = 0.8
"""Smallest probability of a decision that is reported."""
_DRAWS = 200


def seeds_for_decision(
    test: Test, groups: Sequence[FloatArray], metric: str, level: float, seed: int = 0
) -> int | None:
    """The smallest of `FURTHER_SEEDS` that decides a claim with a probability of `ASSURANCE`.

    The probability is an assurance: it averages over what the distributions may be, given the seeds
    so far, by the Bayesian bootstrap (Rubin, 1981). Failures that no seed so far has shown are
    outside of its knowledge.

    Args:
        test: the test of the claim.
        groups: [n], one number per seed, for each cell of the test.
        metric: the metric of the numbers.
        level: level of the test on each side.
        seed: seed of the simulation.

    Returns:
        The number of seeds; None if none of them suffices.
    """
    return next(
        (
            further
            for further in FURTHER_SEEDS
            if decided_share(test, groups, metric, level, further, seed) >= ASSURANCE
        ),
        None,
    )


def decided_share(
    test: Test,
    groups: Sequence[FloatArray],
    metric: str,
    level: float,
    further: int,
    seed: int = 0,
) -> float:
    """Probability that a number of further seeds decides a claim; see `seeds_for_decision`."""
    rng = np.random.default_rng([seed, further])
    futures = [
        np.concatenate([_repeated(group), _drawn(group, further, rng)], 1) for group in groups
    ]
    codes = test.rule(futures, metric)(level).codes
    return float((codes != UNDECIDED).mean())


def _repeated(group: FloatArray) -> FloatArray:
    return np.broadcast_to(group, (_DRAWS, len(group)))


def _drawn(group: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Further seeds, [draws, count]; each draw has other weights of the values."""
    weights = rng.dirichlet(np.ones(len(group)), size=_DRAWS)
    places = rng.random((_DRAWS, count))[:, :, None] > weights.cumsum(axis=1)[:, None, :-1]
    return group[places.sum(axis=2)]
