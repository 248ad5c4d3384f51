"""Times until something happened, such as a return of 200; for some seeds, it never did.

Such a seed is right-censored at the end of its training: its time is only known to be longer.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy
from numpy.typing import ArrayLike

from touchdown.stats.location import OneSided


@dataclass(frozen=True, slots=True)
class Survival:
    """Kaplan and Meier's estimate (1958) of the share of seeds that have not reached it yet."""

    times: tuple[float, ...]
    """When the share falls, in increasing order."""
    shares: tuple[float, ...]
    """The share from each of these times on."""
    low: tuple[float, ...]
    """`low` and `high`: pointwise 95% interval, on the scale of log(-log(share)); NaN where the
    share is 0."""
    high: tuple[float, ...]

    @property
    def median(self) -> float:
        """The first time with a share of at most one half; ∞ if there is none."""
        return next((t for t, s in zip(self.times, self.shares, strict=True) if s <= 0.5), math.inf)


def kaplan_meier(times: Sequence[float], ends: Sequence[float]) -> Survival:
    """Kaplan and Meier's estimate, in SciPy.

    Args:
        times: when each seed reached it; ∞ if it never did.
        ends: until when each seed was observed.

    Raises:
        ValueError: there are no seeds, or a time is NaN or after the seed's end.
    """
    data, reached = _censored(times, ends)
    if not reached.any():
        return Survival((), (), (), ())
    found: Any = scipy.stats.ecdf(data)
    function = found.sf
    interval = function.confidence_interval(method="log-log")
    falls = sorted({float(time) for time in times if math.isfinite(time)})
    at = np.searchsorted(function.quantiles, falls)
    share, low, high = (
        tuple(float(each.probabilities[i]) for i in at)
        for each in (function, interval.low, interval.high)
    )
    return Survival(tuple(falls), share, low, high)


def log_rank(
    times: Sequence[float],
    ends: Sequence[float],
    other_times: Sequence[float],
    other_ends: Sequence[float],
) -> OneSided:
    """Whether one setting takes longer than another: the log-rank test (Mantel, 1966), in SciPy.

    Args:
        times: when each seed of the one reached it; ∞ if it never did.
        ends: until when each seed of the one was observed.
        other_times: the same for the other.
        other_ends: the same for the other.

    Returns:
        P-values: `above` is small if the one takes longer; 1 if no seed of either reached it.

    Raises:
        ValueError: a side has no seeds, or a time is NaN or after the seed's end.
    """
    one, reached = _censored(times, ends)
    other, others_reached = _censored(other_times, other_ends)
    if not reached.any() and not others_reached.any():
        return OneSided(np.array(1.0), np.array(1.0))
    # SciPy's "greater" is about the survival of the second sample
    found: Any = scipy.stats.logrank(one, other, alternative="less")
    above = np.asarray(found.pvalue, float)
    return OneSided(above, 1 - above)


def _censored(times: ArrayLike, ends: ArrayLike) -> tuple[Any, npt.NDArray[np.bool_]]:
    at, until = np.asarray(times, float), np.asarray(ends, float)
    if not len(at) or at.shape != until.shape or np.isnan(at).any() or np.isnan(until).any():
        raise ValueError(f"{len(at)} times need as many ends, got {len(until)}, without NaN")
    reached = np.isfinite(at)
    if (at[reached] > until[reached]).any():
        raise ValueError("a time is after the end of its run")
    data: Any = scipy.stats.CensoredData(uncensored=at[reached], right=until[~reached])
    return data, reached
