"""A study's levels, summarised over their seeds and compared with the base."""

from dataclasses import dataclass

import numpy as np

from touchdown.core.errors import UserError
from touchdown.stats import compare, curves
from touchdown.stats.compare import Comparison
from touchdown.stats.curves import Reached
from touchdown.stats.location import median_interval
from touchdown.stats.seeds import SeedSummary, summarise_seeds
from touchdown.stats.summary import Interval
from touchdown.studies.plan import Cell
from touchdown.studies.results import StudyResults


@dataclass(frozen=True, slots=True)
class AgainstBase:
    """The comparison of a cell with the base."""

    comparison: Comparison
    p_corrected: float
    """p-value of the difference, corrected for the study's other levels (Holm, 1979)."""


@dataclass(frozen=True, slots=True)
class LevelSummary:
    """The numbers of one cell of a study."""

    cell: Cell
    is_base: bool
    seeds: SeedSummary
    """Summary of the metric."""
    median: Interval
    """Of the metric over seeds, with its 95% interval; see `median_interval`."""
    last_weights: float
    """Mean return of the final weights: on test starts, or on validation starts without a test."""
    over_training: float
    """Mean validation return over training."""
    env_steps_to_solved: Reached
    seconds_to_solved: Reached
    against_base: AgainstBase | None
    """None for the base itself, while it or the cell has fewer than two finished seeds, and in a
    study without comparisons."""


def summarise_levels(
    results: StudyResults, metric: str, *, compared: bool = True
) -> list[LevelSummary]:
    """Every cell with a finished run that has the number, in the study's order.

    Args:
        results: results of a study.
        metric: the metric to summarise and compare, one of `METRICS`.
        compared: whether to compare cells with the base.

    Raises:
        UserError: none of the finished runs has this number.
    """
    base = results.study.base_cell()
    every = {cell.labels: results.values(cell.labels, metric) for cell in results.study.cells()}
    values = {labels: of_cell for labels, of_cell in every.items() if len(of_cell)}
    if not values:
        raise UserError(f"metric = {metric!r}: none of the finished runs has it; choose another")
    cells = [cell for cell in results.study.cells() if cell.labels in values]
    of_base = values.get(base.labels, np.empty(0))
    known = {
        labels: compare.compare(of_base, of_cell)
        for labels, of_cell in values.items()
        if compared and labels != base.labels and min(len(of_base), len(of_cell)) > 1
    }
    corrected = compare.holm([found.p_value for found in known.values()])
    against = {
        labels: AgainstBase(found, p)
        for (labels, found), p in zip(known.items(), corrected, strict=True)
    }
    runs_of = [results.of(cell.labels) for cell in cells]
    return [
        LevelSummary(
            cell=cell,
            is_base=cell.labels == base.labels,
            seeds=summarise_seeds(values[cell.labels]),
            median=median_interval(values[cell.labels]),
            last_weights=float(np.mean([run.return_of_last for run in runs])),
            over_training=float(np.mean([run.area for run in runs])),
            env_steps_to_solved=curves.reached([run.env_steps_to_solved for run in runs]),
            seconds_to_solved=curves.reached([run.seconds_to_solved for run in runs]),
            against_base=against.get(cell.labels),
        )
        for cell, runs in zip(cells, runs_of, strict=True)
    ]
