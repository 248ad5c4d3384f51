"""The tests that decide claims, from one number per training seed.

A cell is named by the label of its level or, with several factors, by all labels, such as
`0.99 · 32`.
The fields of a kind have the same names in Python and in a study file. Most kinds compare all
pairs of seeds of two cells (`stats.pairs`), because some runs fail and their numbers can be
anywhere. A margin is the smallest effect of interest, in the metric's unit: return points, a share
from 0 to 1, or environment steps.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from msgspec import Meta

from touchdown.config.checks import settle
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray
from touchdown.stats import pairs, proportions, rules
from touchdown.stats.location import OneSided, sign_test
from touchdown.studies import evidence
from touchdown.studies.findings import Rule
from touchdown.studies.metrics import formatter, is_return

FEWEST_FOR_PAIRS = 10
"""Seeds per cell from which on comparisons of pairs keep their error rate; `touchdown study check`
shows it, and its committed table is docs/error-rates.md."""
FEWEST_FOR_SIGNS = 6
"""Seeds from which on a sign test can be significant at 5%; it is exact with any number."""
MARGIN_OF_FAILURES = 0.15
"""Smallest difference of interest between two probabilities to fail."""

CellName = Annotated[str, Meta(title="the label of a level, such as '0.99'")]
CellNames = Annotated[tuple[CellName, ...], Meta(title="a list of levels' labels")]
Margin = Annotated[float, Meta(gt=0)]
Groups = Sequence[FloatArray]
"""[..., n] for each cell of a test, in order: one number per seed."""


@dataclass(frozen=True, slots=True)
class Greater:
    """One cell typically has more than another: in most pairs of seeds.

    With a number below which a run has failed, failing less often counts, too: it holds if the cell
    is better in one of the two, and shown to be worse in neither.

    Raises:
        UserError: both cells are the same, or the margin is not above 0.
    """

    kind: ClassVar[str] = "greater"
    fewest_seeds: ClassVar[int] = FEWEST_FOR_PAIRS
    above: CellName
    below: CellName
    margin: Margin
    """Smaller differences do not matter."""
    failure: float | None = None
    """A run with a smaller number has failed; None leaves failures out."""

    def __post_init__(self) -> None:
        _check(self, self.cells)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.above, self.below

    def rule(self, groups: Groups, metric: str) -> Rule:
        """The ruling by the level of the test."""
        del metric
        one, other = groups
        parts = [pairs.sides(one, other, self.margin)]
        if self.failure is not None:
            margin = MARGIN_OF_FAILURES
            parts.append(proportions.fewer_failures(one, other, self.failure, margin))
        return partial(rules.higher, parts)

    def evidence(self, groups: Groups, metric: str) -> str:
        """The numbers in words."""
        named = dict(zip(self.cells, groups, strict=True))
        found = evidence.difference(named, self.above, self.below, metric)
        text = f"{evidence.medians(named, metric)}; {found}"
        if self.failure is None:
            return text
        return f"{text}; {evidence.of_failures(named, self.failure)}"


@dataclass(frozen=True, slots=True)
class Trend:
    """The numbers rise, or fall, over levels: the last is beyond the first, and no pair reverses.

    Raises:
        UserError: there are fewer than two levels, a level occurs twice, or the margin is not above
            0.
    """

    kind: ClassVar[str] = "trend"
    fewest_seeds: ClassVar[int] = FEWEST_FOR_PAIRS
    levels: CellNames
    """Labels, in order."""
    margin: Margin
    """Smaller differences between two levels do not matter."""
    direction: Literal["rise", "fall"] = "rise"

    def __post_init__(self) -> None:
        _check(self, self.levels)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.levels

    def rule(self, groups: Groups, metric: str) -> Rule:
        """The ruling by the level of the test."""
        del metric
        ordered = groups if self.direction == "rise" else groups[::-1]
        return partial(rules.monotone, *pairs.sides_of_levels(ordered, self.margin))

    def evidence(self, groups: Groups, metric: str) -> str:
        """The numbers in words."""
        named = dict(zip(self.levels, groups, strict=True))
        first, *_, last = self.levels
        found = evidence.difference(named, last, first, metric)
        return f"{evidence.medians(named, metric)}; {found}"


@dataclass(frozen=True, slots=True)
class Best:
    """One of `among` is the best of all levels: comparisons with the best (Hsu, 1981).

    Raises:
        UserError: `among` is empty, contains all levels or an unknown one, a level occurs twice, or
            the margin is not above 0.
    """

    kind: ClassVar[str] = "best"
    fewest_seeds: ClassVar[int] = FEWEST_FOR_PAIRS
    among: CellNames
    levels: CellNames
    """All levels that are compared, including those of `among`."""
    margin: Margin
    """Smaller differences do not matter."""

    def __post_init__(self) -> None:
        _check(self, self.levels)
        if not set(self.among) < set(self.levels) or not self.among:
            raise UserError(f"among = {list(self.among)!r}: must be some of levels, not all")

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.levels

    def rule(self, groups: Groups, metric: str) -> Rule:
        """The ruling by the level of the test."""
        del metric
        named = dict(zip(self.levels, groups, strict=True))
        others = [named[level] for level in self.levels if level not in self.among]
        against = [
            [pairs.sides(named[each], other, self.margin) for each in self.among]
            for other in others
        ]
        return partial(rules.best, against)

    def evidence(self, groups: Groups, metric: str) -> str:
        """The numbers in words."""
        named = dict(zip(self.levels, groups, strict=True))
        ours, theirs = (
            max(some, key=lambda level: float(np.median(named[level])))
            for some in (self.among, [each for each in self.levels if each not in self.among])
        )
        found = evidence.difference(named, ours, theirs, metric)
        return f"{evidence.medians(named, metric)}; {found}"


@dataclass(frozen=True, slots=True)
class SweetSpot:
    """A level between two others is better than both.

    Raises:
        UserError: two of the three levels are the same, or the margin is not above 0.
    """

    kind: ClassVar[str] = "sweet-spot"
    fewest_seeds: ClassVar[int] = FEWEST_FOR_PAIRS
    inside: CellName
    first: CellName
    last: CellName
    margin: Margin
    """Smaller differences do not matter."""

    def __post_init__(self) -> None:
        _check(self, self.cells)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.first, self.inside, self.last

    def rule(self, groups: Groups, metric: str) -> Rule:
        """The ruling by the level of the test."""
        return Best((self.inside,), self.cells, self.margin).rule(groups, metric)

    def evidence(self, groups: Groups, metric: str) -> str:
        """The numbers in words."""
        named = dict(zip(self.cells, groups, strict=True))
        ends = (self.first, self.last)
        found = [evidence.difference(named, self.inside, end, metric) for end in ends]
        return "; ".join([evidence.medians(named, metric), *found])


@dataclass(frozen=True, slots=True)
class Beyond:
    """Most seeds of a cell are above, or below, a number: the sign test."""

    kind: ClassVar[str] = "beyond"
    fewest_seeds: ClassVar[int] = FEWEST_FOR_SIGNS
    level: CellName
    number: float
    """In the metric's unit."""
    side: Literal["above", "below"] = "above"

    def __post_init__(self) -> None:
        _check(self)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return (self.level,)

    def rule(self, groups: Groups, metric: str) -> Rule:
        """The ruling by the level of the test."""
        del metric
        found = sign_test(groups[0], self.number)
        return partial(rules.beyond, found if self.side == "above" else OneSided(*found[::-1]))

    def evidence(self, groups: Groups, metric: str) -> str:
        """The numbers in words."""
        (seen,) = groups
        count = int((seen > self.number if self.side == "above" else seen < self.number).sum())
        number = formatter(metric, (seen,))(self.number)
        against = f"{number}; {count} of {len(seen)} seeds {self.side} it"
        return evidence.median_against(self.level, seen, metric, against)


@dataclass(frozen=True, slots=True)
class Near:
    """The median of a cell is within a margin of a number: two sign tests.

    A return above the margin is *reached and exceeded*.

    Raises:
        UserError: the margin is not above 0.
    """

    kind: ClassVar[str] = "near"
    fewest_seeds: ClassVar[int] = FEWEST_FOR_SIGNS
    level: CellName
    number: float
    """In the metric's unit."""
    within: Margin
    """The margin, in the same unit."""

    def __post_init__(self) -> None:
        _check(self)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return (self.level,)

    def rule(self, groups: Groups, metric: str) -> Rule:
        """The ruling by the level of the test."""
        ends = (sign_test(groups[0], self.number + by) for by in (-self.within, self.within))
        return partial(rules.near, *ends, exceeds=is_return(metric))

    def evidence(self, groups: Groups, metric: str) -> str:
        """The numbers in words."""
        against = f"{self.number:g} ± {self.within:g}"
        return evidence.median_against(self.level, groups[0], metric, against)


@dataclass(frozen=True, slots=True)
class Alike:
    """Any two of some cells typically differ by less than a margin: two one-sided tests each.

    Raises:
        UserError: there are fewer than two levels, a level occurs twice, or the margin is not above
            0.
    """

    kind: ClassVar[str] = "alike"
    fewest_seeds: ClassVar[int] = FEWEST_FOR_PAIRS
    levels: CellNames
    within: Margin
    """In the metric's unit."""

    def __post_init__(self) -> None:
        _check(self, self.cells)

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells that are tested."""
        return self.levels

    def rule(self, groups: Groups, metric: str) -> Rule:
        """The ruling by the level of the test."""
        del metric
        return partial(rules.within, pairs.sides_of_levels(groups, self.within)[0])

    def evidence(self, groups: Groups, metric: str) -> str:
        """The numbers in words."""
        named = dict(zip(self.levels, groups, strict=True))
        first, *_, last = self.levels
        found = evidence.difference(named, last, first, metric)
        return f"{evidence.medians(named, metric)}; {found}, against ± {self.within:g}"


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
