"""The tests that decide claims, from one number per training seed.

A cell is named by the label of its level or, with two factors, by both labels, such as `0.99 · 32`.
The fields of a kind have the same names in Python and in a study file.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from msgspec import Meta

from touchdown.config.checks import settle
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray
from touchdown.stats import compare
from touchdown.stats.summary import Interval
from touchdown.studies.findings import Finding, SeedsNeeded, Values
from touchdown.studies.metrics import formatter

_MIN_SEEDS = 2  # per cell, for a test to be meaningful

CellName = Annotated[str, Meta(title="the label of a level, such as '0.99'")]
CellNames = Annotated[tuple[CellName, ...], Meta(title="a list of levels' labels")]
Margin = Annotated[float, Meta(gt=0)]


@dataclass(frozen=True, slots=True)
class Greater:
    """The mean of one cell is above that of another: Welch's t.

    Raises:
        UserError: both cells are the same.
    """

    kind: ClassVar[str] = "greater"
    above: CellName
    below: CellName

    def __post_init__(self) -> None:
        _check(self, self.cells)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.above, self.below

    def find(self, values: Values, metric: str) -> Finding | None:
        """The finding; None while there are too few seeds."""
        base, other = values(self.below, metric), values(self.above, metric)
        if min(len(base), len(other)) < _MIN_SEEDS:
            return None
        found = compare.compare(base, other)
        improvement = found.probability_of_improvement.value
        text = formatter(metric, (base, other))
        evidence = (
            f"{self.above} {text(other.mean())}, {self.below} {text(base.mean())}: "
            f"difference {_interval(found.difference, text)}, "
            f"better in {improvement:.0%} of pairs"
        )
        p_for = _one_sided(found.p_value, as_said=found.difference.value > 0)
        seeds = min(len(base), len(other))
        return Finding(p_for, 1 - p_for, evidence, seeds, found.seeds_needed)


@dataclass(frozen=True, slots=True)
class Trend:
    """The numbers rise, or fall, from level to level: Kendall's τ.

    Raises:
        UserError: there are fewer than two levels, or a level occurs twice.
    """

    kind: ClassVar[str] = "trend"
    levels: CellNames
    """Labels, in order."""
    direction: Literal["rise", "fall"] = "rise"

    def __post_init__(self) -> None:
        _check(self, self.levels)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.levels

    def find(self, values: Values, metric: str) -> Finding | None:
        """The finding; None while there are too few seeds."""
        groups = [values(level, metric) for level in self.levels]
        if min(map(len, groups)) < _MIN_SEEDS:
            return None
        found = compare.trend(groups)
        text = formatter(metric, groups)
        means = ", ".join(
            f"{level}: {text(group.mean())}"
            for level, group in zip(self.levels, groups, strict=True)
        )
        as_said = (found.tau > 0) == (self.direction == "rise")
        p_for = _one_sided(found.p_value, as_said=as_said)
        return Finding(
            p_for,
            1 - p_for,
            f"{means}; τ = {found.tau:.2f}",
            min(map(len, groups)),
            found.seeds_needed,
        )


@dataclass(frozen=True, slots=True)
class SweetSpot:
    """A level between two others is better than both: two one-sided t-tests, both significant.

    Raises:
        UserError: two of the three levels are the same.
    """

    kind: ClassVar[str] = "sweet-spot"
    inside: CellName
    first: CellName
    last: CellName

    def __post_init__(self) -> None:
        _check(self, self.cells)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.first, self.inside, self.last

    def find(self, values: Values, metric: str) -> Finding | None:
        """The finding; None while there are too few seeds."""
        sides = [Greater(self.inside, end).find(values, metric) for end in (self.first, self.last)]
        known = [side for side in sides if side is not None]
        if len(known) < len(sides):
            return None
        groups = {cell: values(cell, metric) for cell in self.cells}
        text = formatter(metric, groups.values())
        means = ", ".join(f"{cell}: {text(group.mean())}" for cell, group in groups.items())
        return _both(known, means)


@dataclass(frozen=True, slots=True)
class Best:
    """One of `among` has the greatest mean of all levels: tested by resampling the seeds.

    Raises:
        UserError: `among` is empty, contains all levels or an unknown one, or a level occurs twice.
    """

    kind: ClassVar[str] = "best"
    among: CellNames
    levels: CellNames
    """All levels that are compared, including those of `among`."""

    def __post_init__(self) -> None:
        _check(self, self.levels)
        if not set(self.among) < set(self.levels) or not self.among:
            raise UserError(f"among = {list(self.among)!r}: must be some of levels, not all")

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.levels

    def find(self, values: Values, metric: str) -> Finding | None:
        """The finding; None while there are too few seeds."""
        groups = [values(level, metric) for level in self.levels]
        if min(map(len, groups)) < _MIN_SEEDS:
            return None
        chances = compare.best_of(groups)
        wanted = math.fsum(
            chance
            for level, chance in zip(self.levels, chances, strict=True)
            if level in self.among
        )
        ranked = sorted(zip(chances, self.levels, groups, strict=True), key=lambda e: -e[0])
        text = formatter(metric, groups)
        best = ", ".join(
            f"{level} {text(group.mean())} (best in {chance:.0%} of resamples)"
            for chance, level, group in ranked[:3]
        )
        needed = self._needed(dict(zip(self.levels, groups, strict=True)))
        return Finding(1 - wanted, wanted, best, min(map(len, groups)), needed)

    def _needed(self, groups: dict[str, FloatArray]) -> SeedsNeeded:
        """Seeds needed to tell the best of `among` from the best of the others."""
        means = {level: float(np.mean(group)) for level, group in groups.items()}
        ours = max(self.among, key=lambda level: means[level])
        rest = [level for level in self.levels if level not in self.among]
        theirs = max(rest, key=lambda level: means[level])
        return compare.compare(groups[theirs], groups[ours]).seeds_needed


@dataclass(frozen=True, slots=True)
class Beyond:
    """The mean of a cell is above, or below, a number: Student's t-test."""

    kind: ClassVar[str] = "beyond"
    level: CellName
    number: float
    """In the metric's unit: return points, or a share from 0 to 1."""
    side: Literal["above", "below"] = "above"

    def __post_init__(self) -> None:
        _check(self)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return (self.level,)

    def find(self, values: Values, metric: str) -> Finding | None:
        """The finding; None while there are too few seeds."""
        seen = values(self.level, metric)
        if len(seen) < _MIN_SEEDS:
            return None
        found = compare.margin(seen, self.number)
        text = formatter(metric, (seen, np.array([self.number])))
        evidence = (
            f"{self.level} {_interval(found.mean, text)}, "
            f"{len(seen)} seeds, against {text(self.number)}"
        )
        sides = (found.p_above, found.p_below)
        p_for, p_against = sides if self.side == "above" else sides[::-1]
        return Finding(p_for, p_against, evidence, len(seen), found.seeds_needed)


@dataclass(frozen=True, slots=True)
class Near:
    """The mean of a cell is within a margin of a number: two one-sided tests (Schuirmann, 1987).

    Raises:
        UserError: the margin is not above 0.
    """

    kind: ClassVar[str] = "near"
    level: CellName
    number: float
    """In the metric's unit: return points, or a share from 0 to 1."""
    within: Margin
    """The margin, in the same unit."""

    def __post_init__(self) -> None:
        _check(self)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return (self.level,)

    def find(self, values: Values, metric: str) -> Finding | None:
        """The finding; None while there are too few seeds."""
        seen = values(self.level, metric)
        if len(seen) < _MIN_SEEDS:
            return None
        low = compare.margin(seen, self.number - self.within)
        high = compare.margin(seen, self.number + self.within)
        evidence = (
            f"{self.level} {_interval(low.mean, formatter(metric, (seen,)))}, "
            f"{len(seen)} seeds, against {self.number:g} ± {self.within:g}"
        )
        sides = (
            Finding(low.p_above, low.p_below, "", len(seen), low.seeds_needed),
            Finding(high.p_below, high.p_above, "", len(seen), high.seeds_needed),
        )
        return _both(sides, evidence)


@dataclass(frozen=True, slots=True)
class Alike:
    """The means of two cells are within a margin: two one-sided Welch tests (Schuirmann, 1987).

    Raises:
        UserError: the margin is not above 0, or both cells are the same.
    """

    kind: ClassVar[str] = "alike"
    one: CellName
    other: CellName
    within: Margin
    """In the metric's unit: return points, or a share from 0 to 1."""

    def __post_init__(self) -> None:
        _check(self, self.cells)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.one, self.other

    def find(self, values: Values, metric: str) -> Finding | None:
        """The finding; None while there are too few seeds."""
        one, other = values(self.one, metric), values(self.other, metric)
        if min(len(one), len(other)) < _MIN_SEEDS:
            return None
        sides: list[Finding] = []
        # not below by more than the margin, and not above by more
        for shift in (-self.within, self.within):
            found = compare.compare(one + shift, other)
            as_said = (found.difference.value > 0) == (shift < 0)
            p_for = _one_sided(found.p_value, as_said=as_said)
            fewest = min(len(one), len(other))
            sides.append(Finding(p_for, 1 - p_for, "", fewest, found.seeds_needed))
        difference = compare.compare(one, other).difference
        text = formatter(metric, (one, other))
        evidence = (
            f"{self.other} {text(other.mean())}, {self.one} {text(one.mean())}: "
            f"difference {_interval(difference, text)}, against ± {self.within:g}"
        )
        return _both(sides, evidence)


Test = Greater | Trend | SweetSpot | Best | Beyond | Near | Alike
KINDS: dict[str, type[Test]] = {
    each.kind: each for each in (Greater, Trend, SweetSpot, Best, Beyond, Near, Alike)
}
"""The kinds by their names in a study file."""


def _check(test: Any, compared: Sequence[str] | None = None) -> None:
    """Refuse fields of the wrong type or out of range, and cells that cannot be compared."""
    try:
        settle(test)
    except ValueError as error:
        raise UserError(str(error)) from None
    if compared is None:
        return
    if len(compared) < 2:
        raise UserError(f"levels = {list(compared)!r}: must be at least 2")
    twice = next((cell for cell in compared if list(compared).count(cell) > 1), None)
    if twice is not None:
        raise UserError(f"level {twice!r}: occurs twice, must occur once")


def _one_sided(p: float, *, as_said: bool) -> float:
    """The one-sided p-value in favour, from the two-sided one and the sign of the difference."""
    return p / 2 if as_said else 1 - p / 2


def _both(sides: Sequence[Finding], evidence: str) -> Finding:
    """The finding of two tests that must both support the claim."""
    p_for = max(side.p_for for side in sides)
    # the claim fails if either test does, which doubles the probability of that by chance
    p_against = min(1.0, 2 * min(side.p_against for side in sides))

    def seeds_needed(alpha: float) -> int | None:
        if p_for < p_against:
            needed = [side.seeds_needed(alpha) for side in sides]
            return None if None in needed else max(n for n in needed if n is not None)
        failing = [side.seeds_needed(alpha / 2) for side in sides if side.p_for > side.p_against]
        return min((n for n in failing if n is not None), default=None)

    return Finding(p_for, p_against, evidence, min(side.seeds for side in sides), seeds_needed)


def _interval(found: Interval, text: Callable[[float], str]) -> str:
    return f"{text(found.value)} [{text(found.low)}, {text(found.high)}]"
