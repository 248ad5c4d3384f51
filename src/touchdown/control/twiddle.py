"""Twiddle: coordinate ascent with a step size for each coordinate (appendix C)."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

GROW, SHRINK = 1.1, 0.9  # factors for a step size after a success and after a failure


class Trial(NamedTuple):
    """One evaluation of the objective, and the best point so far."""

    value: float
    best_value: float
    best: tuple[float, ...]
    step: float
    """The largest step relative to its initial size; the search ends when it is small."""


def twiddle(
    objective: Callable[[tuple[float, ...]], float],
    start: Sequence[float],
    steps: Sequence[float],
    tolerance: float = 0.02,
) -> Iterator[Trial]:
    """Maximise `objective`, one coordinate at a time, and yield every trial.

    Each coordinate is tried one step up, then one step down. A success keeps the point and grows
    the step; failures in both directions shrink it. The search ends when every step has shrunk to
    `tolerance` times its initial size. It is a local search and can only find a local maximum.

    Args:
        objective: value of a point; larger is better.
        start: the first point.
        steps: first step size of each coordinate, above 0.
        tolerance: fraction of the initial step sizes at which to stop, between 0 and 1.

    Raises:
        ValueError: the lengths differ, or a step or the tolerance is out of range.
    """
    if len(start) != len(steps) or not start:
        raise ValueError(f"{len(start)} coordinates need as many steps, got {len(steps)}")
    if min(steps) <= 0:
        raise ValueError(f"steps must be above 0, got {list(steps)}")
    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance must be between 0 and 1, got {tolerance}")
    first = np.array(steps, float)
    step = first.copy()
    best = np.array(start, float)
    best_value = objective(tuple(best.tolist()))
    yield Trial(best_value, best_value, tuple(best.tolist()), 1.0)
    while (step / first).max() > tolerance:
        for i in range(len(best)):
            for direction in (1, -1):
                point = best.copy()
                point[i] += direction * step[i]
                value = objective(tuple(point.tolist()))
                improved = value > best_value
                if improved:
                    best, best_value = point, value
                yield Trial(value, best_value, tuple(best.tolist()), float((step / first).max()))
                if improved:
                    break
            step[i] *= GROW if improved else SHRINK
