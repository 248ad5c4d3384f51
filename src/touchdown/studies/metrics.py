"""What claims, comparisons and figures may be about: one number per run."""

METRICS = {
    "best_return": "test return of the chosen checkpoint",
    "last_return": "test return of the last weights",
    "validation_return": "validation return of the chosen checkpoint",
    "early_return": "mean validation return over the first third of training",
    "area": "mean validation return over training",
    "hover_share": "share of training episodes that ran 1000 steps",
    "worst_return": "lowest of the test returns",
}
"""What each number is, in return points or shares; fields of `RunResult`."""
DEFAULT_METRIC = "best_return"
TEST_METRICS = ("best_return", "last_return", "worst_return")
"""Those that a run without a test does not have."""


def is_share(metric: str) -> bool:
    """Whether a metric's numbers are shares, from 0 to 1, rather than return points."""
    return metric.endswith("_share")
