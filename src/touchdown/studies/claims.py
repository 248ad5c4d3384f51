"""Claims and their verdicts; each is decided by a test on the seeds' numbers, never by a person."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from touchdown.core.types import FloatArray
from touchdown.stats import compare

_LEAST_P = 0.001  # smaller ones are shown as "< 0.001"

Labels = tuple[str, ...]
Values = Callable[[Labels, str], FloatArray]
"""One number per seed of a cell, [n], by the cell's labels and the metric's name."""
SeedsNeeded = Callable[[float], int | None]
"""Estimated seeds per cell that bring a test's p-value below an alpha; None if more than can be
run."""
Verdict = Literal["holds", "does not hold", "undecided"]
VERDICTS: tuple[Verdict, ...] = ("holds", "does not hold", "undecided")


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of a test."""

    p_for: float
    """One-sided p-value in favour, if the claim were just false."""
    p_against: float
    """One-sided p-value against, if the claim were just true."""
    evidence: str
    seeds: int
    """Number of seeds of the cell with the fewest."""
    seeds_needed: SeedsNeeded
    """Seeds needed for the two-sided p-value to be below an alpha."""

    @property
    def p_value(self) -> float:
        """Two-sided."""
        return min(1.0, 2 * min(self.p_for, self.p_against))


class Test(Protocol):
    """Decides a claim."""

    def find(self, values: Values) -> Finding | None:
        """Test the claim on these numbers; None if there are too few seeds."""
        ...


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement of the paper, paraphrased, and the test that decides it."""

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
    """Two-sided p-value, corrected for the study's other claims; 1 if there are too few runs."""


def decide(claims: Sequence[Claim], values: Values) -> list[Decision]:
    """Decide each claim; the probability that any verdict is wrong is at most 5% (Holm, 1979).

    Args:
        claims: the claims of one study.
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
    # the correction increased the p-value, so alpha decreases by the same factor
    needed = finding.seeds_needed(compare.ALPHA * finding.p_value / p)
    if needed is None:
        return Decision(
            claim, "undecided", f"{text}; no number of seeds that can be run would decide it", p
        )
    more = max(1, needed - finding.seeds)
    advice = f"about {more} more {'seed' if more == 1 else 'seeds'} of each would decide it"
    return Decision(claim, "undecided", f"{text}; {advice}", p)


def p_text(p: float) -> str:
    """A p-value with as many digits as are meaningful."""
    return "< 0.001" if p < _LEAST_P else f"{p:.2g}" if p < 0.1 else f"{p:.2f}"
