"""What a test of a claim finds, and how a p-value is shown."""

from collections.abc import Callable
from dataclasses import dataclass

from touchdown.core.types import FloatArray

LEAST_P = 0.001
"""Smaller p-values are shown as "< 0.001"."""

Values = Callable[[str, str], FloatArray]
"""One number per seed of a cell, [n], by the cell's name and the metric's."""
SeedsNeeded = Callable[[float], int | None]
"""How many seeds of each cell would likely bring a test's p-value below an alpha; None if more
than anyone can run."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What a test found."""

    p_for: float
    """Chance of numbers at least as much in favour if the claim were only just false."""
    p_against: float
    """Chance of numbers at least as much against it if the claim were only just true."""
    evidence: str
    seeds: int
    """Seeds of the cell that has the fewest."""
    seeds_needed: SeedsNeeded
    """By the alpha that the two-sided p-value must be below."""

    @property
    def p_value(self) -> float:
        """Two-sided."""
        return min(1.0, 2 * min(self.p_for, self.p_against))


def p_text(p: float) -> str:
    """A p-value with as many digits as are meaningful."""
    return "< 0.001" if p < LEAST_P else f"{p:.2g}" if p < 0.1 else f"{p:.2f}"
