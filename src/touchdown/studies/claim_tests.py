"""Tests that decide claims, each on one number per training seed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from touchdown.core.types import FloatArray
from touchdown.stats import compare
from touchdown.stats.summary import Interval
from touchdown.studies.claims import Finding, Labels, SeedsNeeded, Values

_MIN_SEEDS = 2  # per cell, for a test to be meaningful


@dataclass(frozen=True, slots=True)
class Greater:
    """The mean of one cell is above that of another: Welch's t-test."""

    above: Labels
    below: Labels
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        base, other = values(self.below, self.metric), values(self.above, self.metric)
        if min(len(base), len(other)) < _MIN_SEEDS:
            return None
        found = compare.compare(base, other)
        improvement = found.probability_of_improvement.value
        evidence = (
            f"{_name(self.above)} {_mean(other, self.metric)}, "
            f"{_name(self.below)} {_mean(base, self.metric)}: "
            f"difference {_interval(found.difference, self.metric)}, "
            f"better in {improvement:.0%} of pairs"
        )
        p_for = _one_sided(found.p_value, as_said=found.difference.value > 0)
        seeds = min(len(base), len(other))
        return Finding(p_for, 1 - p_for, evidence, seeds, found.seeds_needed)


@dataclass(frozen=True, slots=True)
class Monotonic:
    """The numbers increase, or decrease, from level to level: Kendall's τ."""

    levels: tuple[Labels, ...]
    direction: Literal["rise", "fall"] = "rise"
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        groups = [values(level, self.metric) for level in self.levels]
        if min(map(len, groups)) < _MIN_SEEDS:
            return None
        found = compare.trend(groups)
        means = ", ".join(
            f"{_name(level)}: {_mean(group, self.metric)}"
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
    """A level between two others is better than both: two one-sided t-tests."""

    inside: Labels
    first: Labels
    last: Labels
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        sides = [
            Greater(self.inside, end, self.metric).find(values) for end in (self.first, self.last)
        ]
        known = [side for side in sides if side is not None]
        if len(known) < len(sides):
            return None
        means = ", ".join(
            f"{_name(level)}: {_mean(values(level, self.metric), self.metric)}"
            for level in (self.first, self.inside, self.last)
        )
        return _both(known, means)


@dataclass(frozen=True, slots=True)
class Best:
    """One of `among` has the largest mean of all levels: how often, when seeds are resampled."""

    among: tuple[Labels, ...]
    levels: tuple[Labels, ...]
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        groups = [values(level, self.metric) for level in self.levels]
        if min(map(len, groups)) < _MIN_SEEDS:
            return None
        chances = compare.best_of(groups)
        wanted = math.fsum(
            chance
            for level, chance in zip(self.levels, chances, strict=True)
            if level in self.among
        )
        ranked = sorted(zip(chances, self.levels, groups, strict=True), key=lambda e: -e[0])
        best = ", ".join(
            f"{_name(level)} {_mean(group, self.metric)} (best in {chance:.0%} of resamples)"
            for chance, level, group in ranked[:3]
        )
        return Finding(1 - wanted, wanted, best, min(map(len, groups)), self._needed(values))

    def _needed(self, values: Values) -> SeedsNeeded:
        """Seeds needed to distinguish the best of `among` from the best of the others."""
        means = {level: float(np.mean(values(level, self.metric))) for level in self.levels}
        ours = max(self.among, key=lambda level: means[level])
        rest = [level for level in self.levels if level not in self.among]
        theirs = max(rest, key=lambda level: means[level])
        return compare.compare(values(theirs, self.metric), values(ours, self.metric)).seeds_needed


@dataclass(frozen=True, slots=True)
class Beyond:
    """The mean of a cell is above, or below, a number: Student's t-test."""

    cell: Labels
    number: float
    side: Literal["above", "below"] = "above"
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        seen = values(self.cell, self.metric)
        if len(seen) < _MIN_SEEDS:
            return None
        found = compare.margin(seen, self.number)
        evidence = (
            f"{_name(self.cell)} {_interval(found.mean, self.metric)}, "
            f"{len(seen)} seeds, against {_number(self.number, self.metric)}"
        )
        sides = (found.p_above, found.p_below)
        p_for, p_against = sides if self.side == "above" else sides[::-1]
        return Finding(p_for, p_against, evidence, len(seen), found.seeds_needed)


@dataclass(frozen=True, slots=True)
class Near:
    """The mean of a cell is within a margin of a number: two one-sided tests (Schuirmann, 1987)."""

    cell: Labels
    number: float
    within: float
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        seen = values(self.cell, self.metric)
        if len(seen) < _MIN_SEEDS:
            return None
        low = compare.margin(seen, self.number - self.within)
        high = compare.margin(seen, self.number + self.within)
        evidence = (
            f"{_name(self.cell)} {_interval(low.mean, self.metric)}, "
            f"{len(seen)} seeds, against {self.number:g} ± {self.within:g}"
        )
        sides = (
            Finding(low.p_above, low.p_below, "", len(seen), low.seeds_needed),
            Finding(high.p_below, high.p_above, "", len(seen), high.seeds_needed),
        )
        return _both(sides, evidence)


@dataclass(frozen=True, slots=True)
class Alike:
    """The means of two cells are within a margin: two one-sided Welch tests (Schuirmann, 1987)."""

    one: Labels
    other: Labels
    within: float
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        one, other = values(self.one, self.metric), values(self.other, self.metric)
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
        evidence = (
            f"{_name(self.other)} {_mean(other, self.metric)}, "
            f"{_name(self.one)} {_mean(one, self.metric)}: "
            f"difference {_interval(difference, self.metric)}, against ± {self.within:g}"
        )
        return _both(sides, evidence)


def _one_sided(p: float, *, as_said: bool) -> float:
    """The one-sided p-value in favour, from the two-sided one and the sign of the difference."""
    return p / 2 if as_said else 1 - p / 2


def _both(sides: Sequence[Finding], evidence: str) -> Finding:
    """The finding from two tests that must both be in favour."""
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


def _interval(found: Interval, metric: str) -> str:
    low, high = _number(found.low, metric), _number(found.high, metric)
    return f"{_number(found.value, metric)} [{low}, {high}]"


def _name(labels: Labels) -> str:
    return " · ".join(labels)


def _number(value: float, metric: str) -> str:
    if metric.endswith("_share"):
        return f"{value:.1%}"
    return f"{value:.3f}" if metric in ("distance", "ratio") else f"{value:.0f}"


def _mean(values: FloatArray, metric: str) -> str:
    return _number(float(np.mean(values)), metric)
