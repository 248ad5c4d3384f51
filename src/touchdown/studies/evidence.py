"""The numbers behind a verdict, as a sentence."""

from collections.abc import Callable, Mapping

import numpy as np

from touchdown.core.types import FloatArray
from touchdown.stats import pairs, proportions
from touchdown.stats.location import median_interval
from touchdown.stats.summary import Interval
from touchdown.studies.metrics import formatter


def interval_of(found: Interval, text: Callable[[float], str]) -> str:
    """A number with its interval."""
    return f"{text(found.value)} [{text(found.low)}, {text(found.high)}]"


def medians(groups: Mapping[str, FloatArray], metric: str) -> str:
    """The median of each cell."""
    text = formatter(metric, groups.values())
    return "medians " + ", ".join(
        f"{cell}: {text(_median(group))}" for cell, group in groups.items()
    )


def difference(groups: Mapping[str, FloatArray], one: str, other: str, metric: str) -> str:
    """How much more one cell typically has than another, and in how many pairs of seeds."""
    a, b = groups[one], groups[other]
    share = f"{pairs.share_of_pairs(a, b):.0%} of pairs"
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return f"{one} has more than {other} in {share}"
    found = interval_of(pairs.typical_difference(a, b), formatter(metric, (a, b)))
    return f"{one} minus {other} typically {found}, above 0 in {share}"


def of_failures(groups: Mapping[str, FloatArray], threshold: float) -> str:
    """How many seeds of each cell failed, with intervals of the probability."""
    found = {cell: proportions.failures(group, threshold) for cell, group in groups.items()}
    counts = ", ".join(
        f"{cell} {each.failed} of {each.n} [{each.share.low:.0%}, {each.share.high:.0%}]"
        for cell, each in found.items()
    )
    return f"failed, below {threshold:g}: {counts}"


def median_against(cell: str, values: FloatArray, metric: str, against: str) -> str:
    """A cell's median with its interval, the number of seeds, and what it is compared with."""
    text = formatter(metric, (values,))
    return (
        f"{cell}: median {interval_of(median_interval(values), text)}, {len(values)} seeds, "
        f"against {against}"
    )


def _median(values: FloatArray) -> float:
    return median_interval(values).value
