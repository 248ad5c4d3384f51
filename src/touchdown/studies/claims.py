"""Claims and what decides them: each is a test on numbers of seeds, and no verdict is by hand."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from touchdown.core.types import FloatArray
from touchdown.stats import compare
from touchdown.stats.summary import Interval

_LEAST_P = 0.001  # that is told as it is
_FEWEST = 2  # seeds of each cell that a test looks at

Labels = tuple[str, ...]
Values = Callable[[Labels, str], FloatArray]
"""Numbers of a cell's seeds, [n], by its labels and the metric's name."""
SeedsNeeded = Callable[[float], int | None]
"""Seeds of each cell with which a test would likely be below an alpha; None where no number that
can be run would do."""
Verdict = Literal["holds", "does not hold", "undecided"]


@dataclass(frozen=True, slots=True)
class Finding:
    """What a test found."""

    p_for: float
    """How often numbers as much in favour would come by chance, were the claim just not true."""
    p_against: float
    """How often numbers as much against it would come by chance, were the claim just true."""
    evidence: str
    seeds: int
    """Of the cell with the fewest."""
    seeds_needed: SeedsNeeded
    """By the alpha of its two-sided p-value."""

    @property
    def p_value(self) -> float:
        """Two-sided."""
        return min(1.0, 2 * min(self.p_for, self.p_against))


class Test(Protocol):
    """Decides a claim."""

    def find(self, values: Values) -> Finding | None:
        """What the numbers say; None while there are too few."""
        ...


@dataclass(frozen=True, slots=True)
class Claim:
    """A sentence of the paper, in our words, and the test that decides it."""

    sentence: str
    section: str
    test: Test


@dataclass(frozen=True, slots=True)
class Decision:
    """A claim with its verdict."""

    claim: Claim
    verdict: Verdict
    evidence: str
    p_value: float
    """Two-sided, corrected for the other claims of the study; 1 while there are too few runs."""


def decide(claims: Sequence[Claim], values: Values) -> list[Decision]:
    """A verdict on each claim, together in error at most one time in twenty (Holm, 1979).

    Args:
        claims: of one study.
        values: the study's numbers.
    """
    findings = [claim.test.find(values) for claim in claims]
    raw = [1.0 if found is None else found.p_value for found in findings]
    return [
        _decision(claim, finding, p)
        for claim, finding, p in zip(claims, findings, compare.holm(raw), strict=True)
    ]


def _decision(claim: Claim, finding: Finding | None, p: float) -> Decision:
    if finding is None:
        return Decision(claim, "undecided", "too few finished runs", 1.0)
    text = f"{finding.evidence}; p {p_text(p) if p < _LEAST_P else f'= {p_text(p)}'}"
    if p < compare.ALPHA:
        return Decision(
            claim, "holds" if finding.p_for < finding.p_against else "does not hold", text, p
        )
    # the correction made its p-value greater, and so makes its alpha less
    needed = finding.seeds_needed(compare.ALPHA * finding.p_value / p)
    if needed is None:
        return Decision(
            claim, "undecided", f"{text}; no number of seeds that can be run would decide it", p
        )
    more = max(1, needed - finding.seeds)
    said = f"about {more} more {'seed' if more == 1 else 'seeds'} of each would decide it"
    return Decision(claim, "undecided", f"{text}; {said}", p)


def p_text(p: float) -> str:
    """A p-value in as many digits as it bears."""
    return "< 0.001" if p < _LEAST_P else f"{p:.2g}" if p < 0.1 else f"{p:.2f}"


@dataclass(frozen=True, slots=True)
class Greater:
    """The mean of one cell is above that of another: Welch's t."""

    above: Labels
    below: Labels
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        base, other = values(self.below, self.metric), values(self.above, self.metric)
        if min(len(base), len(other)) < _FEWEST:
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
class Trend:
    """The numbers rise, or fall, from level to level: Kendall's τ."""

    levels: tuple[Labels, ...]
    direction: Literal["rise", "fall"] = "rise"
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        groups = [values(level, self.metric) for level in self.levels]
        if min(map(len, groups)) < _FEWEST:
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
    """A level inside is better than both ends: the two one-sided t tests must both say so."""

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
    """One of some levels has the greatest mean of all: how often, resampling the seeds."""

    among: tuple[Labels, ...]
    levels: tuple[Labels, ...]
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        groups = [values(level, self.metric) for level in self.levels]
        if min(map(len, groups)) < _FEWEST:
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
        """Seeds to tell the best from the best of the others."""
        means = {level: float(np.mean(values(level, self.metric))) for level in self.levels}
        ours = max(self.among, key=lambda level: means[level])
        rest = [level for level in self.levels if level not in self.among]
        theirs = max(rest, key=lambda level: means[level])
        return compare.compare(values(theirs, self.metric), values(ours, self.metric)).seeds_needed


@dataclass(frozen=True, slots=True)
class Beyond:
    """The mean of a cell is above, or below, a number: Student's t."""

    cell: Labels
    number: float
    side: Literal["above", "below"] = "above"
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        seen = values(self.cell, self.metric)
        if len(seen) < _FEWEST:
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
    """The mean of a cell is within so much of a number: two one-sided tests (Schuirmann, 1987)."""

    cell: Labels
    number: float
    within: float
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        seen = values(self.cell, self.metric)
        if len(seen) < _FEWEST:
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
    """Two cells' means are near each other: two one-sided Welch tests (Schuirmann, 1987)."""

    one: Labels
    other: Labels
    within: float
    metric: str = "best_return"

    def find(self, values: Values) -> Finding | None:
        """See `Test`."""
        one, other = values(self.one, self.metric), values(self.other, self.metric)
        if min(len(one), len(other)) < _FEWEST:
            return None
        sides: list[Finding] = []
        # not so much below, and not so much above
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
    """The p-value in favour, from a two-sided one and the side on which the numbers are."""
    return p / 2 if as_said else 1 - p / 2


def _both(sides: Sequence[Finding], evidence: str) -> Finding:
    """What two tests say that must both be in favour."""
    p_for = max(side.p_for for side in sides)
    # it fails where either does: twice the chance of that by luck
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
