"""The result of testing a claim, and the format of p-values."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from touchdown.core.types import FloatArray
from touchdown.stats.rules import EXCEEDS, FAILS, HOLDS, NO_DIFFERENCE, UNDECIDED, Ruling

LEAST_P = 0.001
"""Smaller p-values are shown as "< 0.001"."""

Values = Callable[[str, str], FloatArray]
"""One number per seed of a cell, [n], by the cell's name and the metric's."""

Verdict = Literal[
    "holds",
    "does not hold",
    "no difference that matters",
    "reached and exceeded",
    "undecided",
    "preview",
]
"""What becomes of a claim; `preview`: evidence from runs that decide no claim."""
VERDICTS: dict[int, Verdict] = {
    HOLDS: "holds",
    EXCEEDS: "reached and exceeded",
    NO_DIFFERENCE: "no difference that matters",
    FAILS: "does not hold",
    UNDECIDED: "undecided",
}
"""Verdicts by the codes of `stats.rules`, in the order in which a page counts them."""

Rule = Callable[[float], Ruling]
"""A claim's ruling by the level of its test: the probability of a wrong verdict on each side."""


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of a test."""

    rule: Rule
    evidence: str
    seeds: int
    """Smallest number of seeds in a cell."""

    @property
    def p_value(self) -> float:
        """The smallest two-sided level at which it could be decided."""
        return float(self.rule(0.5).p_value)

    def verdict(self, alpha: float) -> Verdict:
        """The verdict at a two-sided level."""
        return VERDICTS[int(self.rule(alpha / 2).codes)]


def evidence_text(finding: Finding, p: float) -> str:
    """The evidence with its p-value, corrected for the other claims."""
    return f"{finding.evidence}; p {p_text(p) if p < LEAST_P else f'= {p_text(p)}'}"


def p_text(p: float) -> str:
    """A p-value with as many digits as are meaningful."""
    return "< 0.001" if p < LEAST_P else f"{p:.2g}" if p < 0.1 else f"{p:.2f}"
