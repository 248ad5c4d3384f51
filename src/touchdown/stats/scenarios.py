"""Distributions of returns on which the tests and intervals are checked by simulation.

They resemble the returns of training runs: most land near 240, and some fail anywhere below.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.random import Generator

from touchdown.core.types import FloatArray
from touchdown.stats.location import TRIM

FAILED_BELOW = 100.0
"""A simulated run with a lower return has failed."""
_LANDED, _SPREAD = 240.0, 15.0
_FAILED, _SPREAD_OF_FAILED = -100.0, 200.0
_CALIBRATION = 200_000  # draws

Draw = Callable[[Generator, tuple[int, ...]], FloatArray]
"""Draws returns of a shape."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """Two settings with different distributions of returns."""

    name: str
    one: Draw
    other: Draw
    is_symmetric: bool = False
    """Whether both are symmetric about the same number, so that no shift makes them equal."""


def _normal(spread: float) -> Draw:
    return lambda rng, shape: rng.normal(_LANDED, spread, shape)


def _failing(share: float) -> Draw:
    """Runs that land, and a share of runs that fail."""

    def draw(rng: Generator, shape: tuple[int, ...]) -> FloatArray:
        landed = rng.normal(_LANDED, _SPREAD, shape)
        failed = rng.normal(_FAILED, _SPREAD_OF_FAILED, shape)
        return np.where(rng.random(shape) < share, failed, landed)

    return draw


def _plateaus(rng: Generator, shape: tuple[int, ...]) -> FloatArray:
    """Runs that stay at one of three levels: hovering, landing roughly, landing."""
    at = rng.choice([-120.0, 200.0, 255.0], p=[0.3, 0.3, 0.4], size=shape)
    return at + rng.normal(0, 4, shape)


def _in_steps(draw: Draw, step: float) -> Draw:
    """Returns rounded to few values, so that many are tied."""
    return lambda rng, shape: step * np.round(draw(rng, shape) / step)


STEADY = _normal(5.0)
SCENARIOS = (
    Scenario("normal", _normal(_SPREAD), _normal(_SPREAD), is_symmetric=True),
    Scenario("unequal spread", STEADY, _normal(60.0), is_symmetric=True),
    Scenario("3% fail", STEADY, _failing(0.03)),
    Scenario("10% fail", STEADY, _failing(0.1)),
    Scenario("20% fail", STEADY, _failing(0.2)),
    Scenario("50% fail", STEADY, _failing(0.5)),
    Scenario("20% against 50% fail", _failing(0.2), _failing(0.5)),
    Scenario("plateaus", STEADY, _plateaus),
    Scenario(
        "ties", _in_steps(_normal(_SPREAD), 20), _in_steps(_normal(40), 20), is_symmetric=True
    ),
)


def parameter_of(values: FloatArray, name: str) -> float:
    """A parameter of many draws: `mean`, `trimmed mean`, `median`, or `failures`, a share."""
    if name == "median":
        return float(np.median(values))
    if name == "failures":
        return float((values < FAILED_BELOW).mean())
    if name == "trimmed mean":
        ordered = np.sort(values)
        cut = int(TRIM * len(values))
        return float(ordered[cut : len(values) - cut].mean())
    return float(values.mean())


@cache
def shift_to_equal(scenario: Scenario, name: str) -> float:
    """The number to add to the other setting that makes a parameter of both equal.

    Args:
        scenario: the two settings.
        name: a parameter of `parameter_of`, or `pairs`: each has more in half of all pairs.
    """
    if scenario.is_symmetric:
        return 0.0
    rng = np.random.default_rng(0)
    one, other = scenario.one(rng, (_CALIBRATION,)), scenario.other(rng, (_CALIBRATION,))
    if name != "pairs":
        return parameter_of(one, name) - parameter_of(other, name)
    ordered = np.sort(other)
    low, high = -1_000.0, 1_000.0
    while high - low > 1e-3:
        middle = (low + high) / 2
        won = np.searchsorted(ordered, one - middle).mean() / _CALIBRATION
        low, high = (middle, high) if won > 0.5 else (low, middle)
    return (low + high) / 2


@cache
def truth_of(draw: Draw, name: str) -> float:
    """A parameter of `parameter_of` of a distribution, from many draws."""
    return parameter_of(draw(np.random.default_rng(1), (_CALIBRATION,)), name)
