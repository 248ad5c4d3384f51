"""What `touchdown study check` simulates: each test, each interval and each rule for a verdict.

An experiment takes a generator, a scenario, a number of repetitions and a number of seeds, and
returns error rates that can be compared with the nominal ones.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy
from numpy.random import Generator

from touchdown.core.types import FloatArray
from touchdown.stats import location, pairs, proportions, rules, survival
from touchdown.stats.location import OneSided
from touchdown.stats.scenarios import (
    FAILED_BELOW,
    STEADY,
    Draw,
    Scenario,
    shift_to_equal,
    truth_of,
)

LEVEL = 0.025
"""Nominal probability of an error on each side."""
EFFECT = 20.0
"""True difference in return points for which tests' power is given."""
MARGIN = 20.0
"""Smallest effect of interest of the simulated claims, in return points."""
_MARGIN_OF_SHARES = 0.15
_STRICT = 0.005  # per side: what Holm's correction demands of ten claims
_LAST = 240_000.0  # environment steps of a simulated run

_Rule = Callable[[float], rules.Ruling]
Kind = Literal["test", "interval", "verdict"]


class Rates(NamedTuple):
    """Rates over repetitions; NaN for what does not apply."""

    error: float
    """Tests and verdicts: share of wrong decisions at 5%, both sides together."""
    strict_error: float
    """The same at 1%."""
    coverage: float
    """Intervals of 95%: share that contains the truth."""
    power: float
    """Share of right decisions where there is an effect."""


@dataclass(frozen=True, slots=True)
class Procedure:
    """Something with a nominal error rate."""

    kind: Kind
    name: str
    run: Callable[[Generator, Scenario, int, int], Rates]
    """From a generator, a scenario, repetitions, and seeds of each setting."""
    share: float = 1.0
    """Share of the repetitions that it gets, because it takes longer."""


def _decided(found: OneSided, level: float) -> float:
    return float((np.minimum(found.above, found.below) <= level).mean())


def _two_sample(test: Callable[[FloatArray, FloatArray], OneSided], parameter: str) -> Any:
    """Errors where a parameter of both settings is equal, power where it differs by `EFFECT`."""

    def run(rng: Generator, scenario: Scenario, repetitions: int, n: int) -> Rates:
        shape = (repetitions, n)
        one = scenario.one(rng, shape)
        other = scenario.other(rng, shape) + shift_to_equal(scenario, parameter)
        null, effect = test(one, other), test(one + EFFECT, other)
        error = _decided(null, LEVEL)
        power = float((effect.above <= LEVEL).mean())
        # the interval has what the test does not reject, so it misses the truth as often
        return Rates(error, _decided(null, _STRICT), 1 - error, power)

    return run


def welch(one: FloatArray, other: FloatArray) -> OneSided:
    """Whether a mean is above, or below, another (Welch, 1947); here for comparison only."""
    with warnings.catch_warnings():
        # tied numbers without variance are equal, or certainly different
        warnings.simplefilter("ignore", RuntimeWarning)
        found: Any = scipy.stats.ttest_ind(
            one, other, axis=-1, equal_var=False, alternative="greater"
        )
    above = np.nan_to_num(np.asarray(found.pvalue, float), nan=0.5)
    return OneSided(above, 1 - above)


def _failures(rng: Generator, scenario: Scenario, repetitions: int, n: int) -> Rates:
    shape = (repetitions, n)

    def test(one: FloatArray, other: FloatArray) -> OneSided:
        return proportions.fewer_failures(one, other, FAILED_BELOW, _MARGIN_OF_SHARES).zero

    other = scenario.other(rng, shape)
    null, effect = test(scenario.other(rng, shape), other), test(STEADY(rng, shape), other)
    power = float((effect.above <= LEVEL).mean())
    return Rates(_decided(null, LEVEL), _decided(null, _STRICT), np.nan, power)


def _log_rank(rng: Generator, scenario: Scenario, repetitions: int, n: int) -> Rates:
    """Times until a threshold; a failed run never reaches it, a better one does so earlier."""

    def times(returns: FloatArray) -> FloatArray:
        at = 1_000.0 * (400.0 - returns)
        return np.where((returns < FAILED_BELOW) | (at > _LAST), np.inf, at)

    one, other = (times(scenario.other(rng, (repetitions, n))) for _ in range(2))
    ends = [_LAST] * n
    found = [
        survival.log_rank(a.tolist(), ends, b.tolist(), ends)
        for a, b in zip(one, other, strict=True)
    ]
    null = OneSided(np.array([p.above for p in found]), np.array([p.below for p in found]))
    return Rates(_decided(null, LEVEL), _decided(null, _STRICT), np.nan, np.nan)


def _interval(ends: Callable[[FloatArray], tuple[FloatArray, FloatArray]], parameter: str) -> Any:
    """Coverage of the parameter of the scenario's other setting."""

    def run(rng: Generator, scenario: Scenario, repetitions: int, n: int) -> Rates:
        low, high = ends(scenario.other(rng, (repetitions, n)))
        truth = truth_of(scenario.other, parameter)
        covered = float(((low <= truth) & (truth <= high)).mean())
        return Rates(np.nan, np.nan, covered, np.nan)

    return run


def _of_mean(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    n = values.shape[-1]
    half = scipy.stats.t.ppf(1 - LEVEL, n - 1) * values.std(axis=-1, ddof=1) / n**0.5
    middle = values.mean(axis=-1)
    return middle - half, middle + half


def _of_trimmed(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    middle = scipy.stats.trim_mean(values, location.TRIM, axis=-1)
    half = location.trimmed_half_width(values)
    return middle - half, middle + half


def _of_median(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    ordered, k = np.sort(values, axis=-1), location.order_statistic(values.shape[-1])
    if k < 1:
        unknown = np.full(values.shape[:-1], np.inf)
        return -unknown, unknown
    return ordered[..., k - 1], ordered[..., -k]


def _of_failures(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    failed = (values < FAILED_BELOW).sum(axis=-1)
    return proportions.clopper_pearson(failed, values.shape[-1])


def _of_failures_wilson(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    return proportions.wilson((values < FAILED_BELOW).sum(axis=-1), values.shape[-1])


def _verdict(
    decide: Callable[[Sequence[FloatArray]], _Rule],
    wrong: Sequence[float],
    wrong_codes: Sequence[int],
    right: Sequence[float],
    right_code: int,
    *,
    alternate: bool = True,
) -> Any:
    """Rates of a rule over several levels.

    Args:
        decide: the rule for the levels' numbers, as a function of the level of the test.
        wrong: what is added to each level where the verdicts `wrong_codes` are wrong.
        wrong_codes: the wrong verdicts.
        right: what is added to each level where `right_code` is the right verdict.
        right_code: the right verdict.
        alternate: whether every other level has the scenario's first distribution, at a shift that
            makes each have more in half of all pairs; otherwise, all have its other one.
    """

    def run(rng: Generator, scenario: Scenario, repetitions: int, n: int) -> Rates:
        shift = shift_to_equal(scenario, "pairs") if alternate else 0.0
        draws: list[tuple[Draw, float]] = [(scenario.other, shift), (scenario.one, 0.0)]
        levels = [draws[i % 2 if alternate else 0] for i in range(len(wrong))]
        numbers = [draw(rng, (repetitions, n)) + by for draw, by in levels]

        def moved(added: Sequence[float]) -> _Rule:
            return decide([x + by for x, by in zip(numbers, added, strict=True)])

        null, effect = moved(wrong), moved(right)
        return Rates(
            float(np.isin(null(LEVEL).codes, wrong_codes).mean()),
            float(np.isin(null(_STRICT).codes, wrong_codes).mean()),
            np.nan,
            float((effect(LEVEL).codes == right_code).mean()),
        )

    return run


def _decide_higher(groups: Sequence[FloatArray]) -> _Rule:
    one, other = groups
    fewer = proportions.fewer_failures(one, other, FAILED_BELOW, _MARGIN_OF_SHARES)
    return partial(rules.higher, [pairs.sides(one, other, MARGIN), fewer])


def _decide_typical(groups: Sequence[FloatArray]) -> _Rule:
    one, other = groups
    return partial(rules.higher, [pairs.sides(one, other, MARGIN)])


def _decide_alike(groups: Sequence[FloatArray]) -> _Rule:
    one, other = groups
    return partial(rules.within, [pairs.sides(one, other, MARGIN)])


def _decide_monotone(groups: Sequence[FloatArray]) -> _Rule:
    return partial(rules.monotone, *pairs.sides_of_levels(groups, MARGIN))


def _decide_best(groups: Sequence[FloatArray]) -> _Rule:
    best, *others = groups
    return partial(rules.best, [[pairs.sides(best, other, MARGIN)] for other in others])


def _near(rng: Generator, scenario: Scenario, repetitions: int, n: int) -> Rates:
    """A median at the upper edge of what is near a number, and one in the middle."""
    values = scenario.other(rng, (repetitions, n)) - truth_of(scenario.other, "median")

    def rate(number: float, codes: Sequence[int], level: float) -> float:
        low, high = (location.sign_test(values, number + by) for by in (-MARGIN, MARGIN))
        return float(np.isin(rules.near(low, high, level, exceeds=True).codes, codes).mean())

    wrong = [rules.HOLDS, rules.EXCEEDS]
    return Rates(
        rate(-MARGIN, wrong, LEVEL),
        rate(-MARGIN, wrong, _STRICT),
        np.nan,
        rate(0.0, [rules.HOLDS], LEVEL),
    )


_EITHER = [rules.HOLDS, rules.FAILS]
PROCEDURES = (
    Procedure("test", "means (Welch)", _two_sample(welch, "mean")),
    Procedure("test", "trimmed means (Yuen)", _two_sample(location.yuen, "trimmed mean")),
    Procedure("test", "most pairs (Brunner-Munzel)", _two_sample(pairs.most_pairs, "pairs")),
    Procedure("test", "failures (Fisher)", _failures),
    Procedure("test", "times (log-rank)", _log_rank, 0.05),
    Procedure("interval", "mean (Student)", _interval(_of_mean, "mean")),
    Procedure(
        "interval", "trimmed mean (Tukey-McLaughlin)", _interval(_of_trimmed, "trimmed mean")
    ),
    Procedure("interval", "median (order statistics)", _interval(_of_median, "median")),
    Procedure(
        "interval", "share of failures (Clopper-Pearson)", _interval(_of_failures, "failures")
    ),
    Procedure("interval", "share of failures (Wilson)", _interval(_of_failures_wilson, "failures")),
    Procedure(
        "verdict",
        "greater: typical return, equal",
        _verdict(_decide_typical, (0, 0), _EITHER, (2 * EFFECT, 0), rules.HOLDS),
        0.5,
    ),
    Procedure(
        "verdict",
        "greater: typical return and failures, equal",
        _verdict(_decide_higher, (0, 0), _EITHER, (2 * EFFECT, 0), rules.HOLDS, alternate=False),
        0.5,
    ),
    Procedure(
        "verdict",
        "greater: no difference, at the margin",
        _verdict(_decide_typical, (MARGIN, 0), [rules.NO_DIFFERENCE], (0, 0), rules.NO_DIFFERENCE),
        0.5,
    ),
    Procedure(
        "verdict",
        "alike, at the margin",
        _verdict(_decide_alike, (MARGIN, 0), _EITHER, (0, 0), rules.HOLDS),
        0.5,
    ),
    Procedure(
        "verdict",
        "trend of five levels, equal",
        _verdict(_decide_monotone, (0,) * 5, _EITHER, (0, 30, 60, 90, 120), rules.HOLDS),
        0.2,
    ),
    Procedure(
        "verdict",
        "trend of five levels, a jump and a decline",
        _verdict(
            _decide_monotone,
            (-245, 0, -10, -20, -30),
            [rules.HOLDS],
            (-245, 0, 0, 0, 0),
            rules.HOLDS,
            alternate=False,
        ),
        0.2,
    ),
    Procedure(
        "verdict",
        "best of five levels, equal",
        _verdict(_decide_best, (0,) * 5, _EITHER, (2 * EFFECT, 0, 0, 0, 0), rules.HOLDS),
        0.2,
    ),
    Procedure("verdict", "near, at the margin", _near, 0.5),
)
"""All that have an error rate."""
