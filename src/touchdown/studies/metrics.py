"""Metrics of claims, comparisons and figures: one number per run."""

METRICS = {
    "best_return": "test return of the selected checkpoint",
    "last_return": "test return of the final weights",
    "validation_return": "validation return of the selected checkpoint",
    "early_return": "mean validation return over the first third of training",
    "area": "mean validation return over training",
    "hover_share": "share of training episodes that ran 1000 steps",
    "worst_return": "lowest test return",
}
"""Description of each metric, in return points or shares; the names are fields of `RunResult`."""
TEST_METRICS = ("best_return", "last_return", "worst_return")
"""Metrics that need a test."""


def is_share(metric: str) -> bool:
    """Whether a metric is a share, from 0 to 1, rather than return points."""
    return metric.endswith("_share")
