"""The result of testing a claim, and the format of p-values."""

from collections.abc import Callable
from dataclasses import dataclass

from touchdown.core.types import FloatArray

LEAST_P = 0.001
"""Smaller p-values are shown as "< 0.001"."""

Values = Callable[[str, str], FloatArray]
"""One number per seed of a cell, [n], by the cell's name and the metric's."""
SeedsNeeded = Callable[[float], int | None]
"""Number of seeds per cell that would probably bring a test's p-value below alpha; None if no
feasible number would."""


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of a test."""

    p_for: float
    """Probability of results at least this favourable, if the claim is only just false."""
    p_against: float
    """Probability of results at least this unfavourable, if the claim is only just true."""
    evidence: str
    seeds: int
    """Smallest number of seeds in a cell."""
    seeds_needed: SeedsNeeded
    """A function of alpha, the level that the two-sided p-value must be below."""

    @property
    def p_value(self) -> float:
        """Two-sided."""
        return min(1.0, 2 * min(self.p_for, self.p_against))


def p_text(p: float) -> str:
    """A p-value with as many digits as are meaningful."""
    return "< 0.001" if p < LEAST_P else f"{p:.2g}" if p < 0.1 else f"{p:.2f}"
