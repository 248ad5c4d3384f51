"""Rules that turn one-sided p-values into verdicts, at a level that may be wrong on each side.

A difference Δ has a smallest effect of interest δ, written down beforehand. A verdict says where Δ
is: above 0, below 0, or within ±δ, which is no difference that matters (two one-sided tests:
Schuirmann, 1987). All arrays have one entry for each simulated data set, or none.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from touchdown.core.types import FloatArray
from touchdown.stats.location import OneSided

Flags = npt.NDArray[np.bool_]
Codes = npt.NDArray[np.int_]

UNDECIDED, HOLDS, FAILS, NO_DIFFERENCE, EXCEEDS = range(5)
"""Codes of verdicts."""


class Sides(NamedTuple):
    """P-values about a difference Δ, against 0 and against both ends of ±δ."""

    zero: OneSided
    margin: OneSided
    """Against δ."""
    negative: OneSided
    """Against −δ."""

    @property
    def swapped(self) -> "Sides":
        """The same about −Δ."""
        return Sides(*(OneSided(each.below, each.above) for each in (self.zero, *self[:0:-1])))

    def rises(self, level: float, tests: int = 1) -> Flags:
        """Whether Δ is above 0, and not shown to be too small to matter.

        Args:
            level: level of the test.
            tests: by how many the level is divided for the first part (Bonferroni).
        """
        return (tests * self.zero.above <= level) & (self.margin.below > level)

    def falls(self, level: float, tests: int = 1) -> Flags:
        """Whether Δ is below 0, and not shown to be too small to matter."""
        return self.swapped.rises(level, tests)

    def equal(self, level: float) -> Flags:
        """Whether Δ is within ±δ."""
        return self.smallest_equal <= level

    @property
    def smallest_equal(self) -> FloatArray:
        """The smallest level at which Δ is within ±δ."""
        return np.maximum(self.margin.below, self.negative.above)


class Ruling(NamedTuple):
    """A rule's verdict, and the smallest level at which it could have been decided."""

    codes: Codes
    p_value: FloatArray
    """Two-sided: twice the level."""


def higher(parts: Sequence[Sides], level: float) -> Ruling:
    """Whether one setting is better than another in at least one part, and worse in none.

    Args:
        parts: such as the typical return, and the probability not to fail. With more than one,
            each is tested at the level divided by their number (Bonferroni).
        level: probability of a wrong verdict on each side.
    """
    k = len(parts)
    rises = _any(each.rises(level, k) for each in parts)
    falls = _any(each.falls(level, k) for each in parts)
    same = _all(each.equal(level) for each in parts)
    smallest = _least(
        [k * each.zero.above for each in parts]
        + [k * each.zero.below for each in parts]
        + [_most([each.smallest_equal for each in parts])]
    )
    return _ruling(same, rises, falls, smallest)


def within(pairs: Sequence[Sides], level: float) -> Ruling:
    """Whether each Δ is within ±δ; it fails if one is outside, with Bonferroni's correction."""
    k = len(pairs)
    inside = _all(each.equal(level) for each in pairs)
    outside = _least([k * p for each in pairs for p in (each.margin.above, each.negative.below)])
    smallest = _least([outside, _most([each.smallest_equal for each in pairs])])
    return _ruling(np.zeros_like(inside), inside, outside <= level, smallest)


def near(low: OneSided, high: OneSided, level: float, *, exceeds: bool) -> Ruling:
    """Whether a value is between two numbers.

    Args:
        low: p-values against the lower one.
        high: p-values against the higher one.
        level: probability of a wrong verdict on each side.
        exceeds: whether a value above both is a verdict of its own, and not a failure.
    """
    inside = (low.above <= level) & (high.below <= level)
    under, over = low.below <= level, high.above <= level
    smallest = _least([low.below, high.above, _most([low.above, high.below])])
    fails = under if exceeds else under | over
    found = _ruling(np.zeros_like(inside), inside, fails, smallest)
    return Ruling(np.where(over & exceeds, EXCEEDS, found.codes), found.p_value)


def beyond(sides: OneSided, level: float) -> Ruling:
    """Whether a value is above a number; it fails if it is below."""
    holds, fails = sides.above <= level, sides.below <= level
    return _ruling(np.zeros_like(holds), holds, fails, _least([sides.above, sides.below]))


def monotone(pairs: Sequence[Sides], ends: Sides, level: float) -> Ruling:
    """Whether numbers rise over ordered levels: no fall that matters, and the last above the first.

    Args:
        pairs: the later minus the earlier of each two levels. A fall of one pair is tested with
            Bonferroni's correction; that no pair falls needs none, because all must show it.
        ends: the last minus the first.
        level: probability of a wrong verdict on each side.
    """
    k = len(pairs)
    falls = _any(each.falls(level, k) for each in pairs)
    steady = _all(each.negative.above <= level for each in pairs)
    same = _all(each.equal(level) for each in pairs)
    smallest = _least(
        [
            *(k * each.zero.below for each in pairs),
            _most([each.smallest_equal for each in pairs]),
            _most([ends.zero.above, *(each.negative.above for each in pairs)]),
        ]
    )
    return _ruling(same, steady & ends.rises(level), falls, smallest)


def best(against: Sequence[Sequence[Sides]], level: float) -> Ruling:
    """Whether one of some settings is the best of all: comparisons with the best (Hsu, 1981).

    Hsu's constrained intervals, with Bonferroni's correction in place of Dunnett's, so that the
    settings may have any spread. It holds if the settings are above each other one. It fails if one
    of the others is above them. It makes no difference if no other one is better by an amount that
    matters, and one of them is as good.

    Args:
        against: for each of the other settings, each of the settings minus it.
        level: probability of a wrong verdict on each side.
    """
    others, ours = len(against), len(against[0])
    above = _all(_any(each.rises(level, ours) for each in of_one) for of_one in against)
    beaten = _any(_all(each.falls(level, others) for each in of_one) for of_one in against)
    unbeaten = _all(
        _any(ours * each.negative.above <= level for each in of_one) for of_one in against
    )
    matched = _any(
        _all(others * each.margin.below <= level for each in of_one) for of_one in against
    )
    smallest = _least(
        [
            _most([ours * _least([e.zero.above for e in of_one]) for of_one in against]),
            _least([others * _most([e.zero.below for e in of_one]) for of_one in against]),
            _most(
                [
                    *(ours * _least([e.negative.above for e in of_one]) for of_one in against),
                    _least(
                        [others * _most([e.margin.below for e in of_one]) for of_one in against]
                    ),
                ]
            ),
        ]
    )
    return _ruling(unbeaten & matched, above, beaten, smallest)


def _ruling(same: Flags, holds: Flags, fails: Flags, smallest: FloatArray) -> Ruling:
    codes = np.select(
        [same, holds & ~fails, fails & ~holds], [NO_DIFFERENCE, HOLDS, FAILS], UNDECIDED
    )
    return Ruling(codes, np.minimum(1.0, 2 * smallest))


def _any(flags: Any) -> Flags:
    return cast(Flags, np.logical_or.reduce(list(flags)))


def _all(flags: Any) -> Flags:
    return cast(Flags, np.logical_and.reduce(list(flags)))


def _least(values: Sequence[FloatArray]) -> FloatArray:
    return cast(FloatArray, np.minimum.reduce(list(values)))


def _most(values: Sequence[FloatArray]) -> FloatArray:
    return cast(FloatArray, np.maximum.reduce(list(values)))
