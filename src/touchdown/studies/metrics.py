"""Metrics of claims, comparisons and figures: one number per run."""

from collections.abc import Callable, Iterable

from touchdown.core.types import FloatArray

METRICS = {
    "best_return": "test return of the selected checkpoint",
    "last_return": "test return of the final weights",
    "validation_return": "validation return of the selected checkpoint",
    "early_return": "mean validation return over the first third of training",
    "area": "mean validation return over training",
    "training_return": "mean return of the last 100 training episodes",
    "hover_share": "share of training episodes that ran 1000 steps",
    "hover_step_share": "share of training steps in episodes that ran 1000 steps",
    "hover_peak_share": "largest share, of any 100 training episodes in a row, that ran 1000 steps",
    "worst_return": "lowest test return",
    "share_solved": "share of test returns that reach the environment's threshold",
    "last_share_solved": "share of test returns of the final weights that reach the threshold",
    "overestimation": "what the final weights expect of a test episode minus what it brings, "
    "discounted",
    "rewarded_share": "share of the replay memory, at the end of training, with a reward above "
    "resave_threshold",
}
"""What each metric measures, in return points or shares; the names are fields of `RunResult`."""
DEFAULT_METRIC = "best_return"
TIMES = {"env_steps_to_solved": "environment steps until a validation first reached the threshold"}
"""Metrics of claims alone: a time is ∞ for a run that never got there, so it has no mean."""
TEST_METRICS = (
    "best_return",
    "last_return",
    "worst_return",
    "share_solved",
    "last_share_solved",
    "overestimation",
)
"""Metrics that need a test."""


_SMALL = 10.0  # smaller numbers are shown with decimals
_OF_PATHS = ("distance", "ratio")  # of the paper's comparison of flights


def is_return(metric: str) -> bool:
    """Whether a metric is in return points, of which more is better."""
    return metric in METRICS and metric != "overestimation" and not is_share(metric)


def more_is_better(metric: str) -> bool:
    """Whether more of a metric is better: a return, or a share of episodes that are solved."""
    return is_return(metric) or metric.endswith("share_solved")


def is_share(metric: str) -> bool:
    """Whether a metric is a share, from 0 to 1, rather than return points."""
    return metric.endswith(("_share", "share_solved"))


def formatter(metric: str, groups: Iterable[FloatArray]) -> Callable[[float], str]:
    """A formatter for a metric's numbers, the same for a whole table or sentence.

    Shares are in percent. Returns are whole numbers, with decimals where all are small.

    Args:
        metric: one of `METRICS`, or of the paper's comparison of flights.
        groups: the numbers that are shown together.
    """
    if is_share(metric):
        return "{:z.1%}".format
    if metric in TIMES:
        return "{:,.0f}".format
    if metric in _OF_PATHS:
        return "{:z.3f}".format
    greatest = max((abs(float(value)) for group in groups for value in group), default=_SMALL)
    return "{:z.0f}".format if greatest >= _SMALL else "{:z.2f}".format  # z: no -0
