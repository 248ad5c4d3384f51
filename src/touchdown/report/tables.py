"""The tables of a study: its levels compared, its claims, its runs."""

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from touchdown.envs.custom import threshold_of
from touchdown.report.page import ClaimRow, Link, Table, TableCell
from touchdown.runs.run import CURVE
from touchdown.stats import compare, curves
from touchdown.stats.seeds import summarise_seeds
from touchdown.stats.summary import Interval
from touchdown.studies.claims import Decision, p_text
from touchdown.studies.metrics import METRICS, is_share
from touchdown.studies.results import RunResult, StudyResults

_NONE = "–"


def claim_rows(decisions: Sequence[Decision]) -> tuple[ClaimRow, ...]:
    """Claims with their verdicts, for the page."""
    return tuple(
        ClaimRow(d.claim.sentence, d.claim.section, d.verdict, d.evidence) for d in decisions
    )


def _points(value: float) -> str:
    return f"{value:.0f}"


def _percent(value: float) -> str:
    return f"{value:.1%}"


def _known(value: float, spec: str) -> str:
    """A number; a dash if the run was not tested and has none."""
    return _NONE if math.isnan(value) else format(value, spec)


def interval_text(found: Interval, text_of: Callable[[float], str] = _points) -> str:
    """A number with its interval.

    Args:
        found: the number and its interval.
        text_of: formats each number; by default as return points.
    """
    return f"{text_of(found.value)} [{text_of(found.low)}, {text_of(found.high)}]"


def level_table(results: StudyResults, metric: str = "best_return") -> Table:
    """Statistics of each cell's seeds, and the comparison with the baseline.

    Args:
        results: results of a study.
        metric: metric that is compared.
    """
    base = results.study.base_cell()
    cells = [cell for cell in results.study.cells() if len(results.of(cell.labels))]
    others = [cell for cell in cells if cell.labels != base.labels]
    known = {
        cell.labels: compare.compare(
            results.values(base.labels, metric), results.values(cell.labels, metric)
        )
        for cell in others
        if min(len(results.of(base.labels)), len(results.of(cell.labels))) > 1
    }
    corrected = dict(
        zip(known, compare.holm([found.p_value for found in known.values()]), strict=True)
    )
    text_of = _percent if is_share(metric) else _points
    rows: list[tuple[TableCell, ...]] = []
    for cell in cells:
        seeds = summarise_seeds(results.values(cell.labels, metric))
        comparison = known.get(cell.labels)
        against = (
            (_NONE,) * 3
            if comparison is None
            else (
                f"{'+' * (comparison.difference.value > 0)}{text_of(comparison.difference.value)}",
                f"{comparison.probability_of_improvement.value:.0%}",
                p_text(corrected[cell.labels]),
            )
        )
        rows.append(
            (
                f"{cell.name} (baseline)" if cell.labels == base.labels else cell.name,
                str(seeds.n),
                interval_text(seeds.iqm, text_of),
                interval_text(seeds.mean, text_of),
                _NONE if seeds.band is None else " to ".join(map(text_of, seeds.band)),
                *(() if is_share(metric) else _training_cells(results, cell.labels)),
                *against,
            )
        )
    return Table(
        f"{METRICS[metric].capitalize()}, by level; against the baseline: difference of means, "
        "probability of improvement, p-value with Holm's correction.",
        (
            "level", "n", "IQM [95%]", "mean [95%]", "band of seeds",
            *(() if is_share(metric) else _training_columns(results)),
            "vs baseline", "P(improvement)", "p",
        ),
        tuple(rows),
    )  # fmt: skip


def _training_columns(results: StudyResults) -> tuple[str, ...]:
    solved = _solved_text(results)
    return "final weights", "over training", f"env steps to {solved}", f"seconds to {solved}"


def _solved_text(results: StudyResults) -> str:
    """The return that counts as solved, or "solved" if levels have different environments."""
    # as recorded: the module of a user's environment may not be importable any more
    thresholds = {run.test.threshold for run in results.runs if run.test}
    if not thresholds:
        thresholds = {threshold_of(cell.config.env_id) for cell in results.study.cells()}
    only = thresholds.pop()
    return "solved" if thresholds or only is None else f"{only:g}"


def _last_weights(run: RunResult) -> float:
    """The return of the final weights, on test starts, or on validation starts without a test."""
    return run.last_return if run.is_tested else run.last_validation


def _training_cells(results: StudyResults, labels: tuple[str, ...]) -> tuple[str, ...]:
    """Training statistics of a level's seeds."""
    runs = results.of(labels)
    return (
        _points(float(np.mean([_last_weights(run) for run in runs]))),
        _points(float(np.mean(results.values(labels, "area")))),
        _to_solved([run.env_steps_to_solved for run in runs]),
        _to_solved([run.seconds_to_solved for run in runs]),
    )


def _to_solved(values: Sequence[float]) -> str:
    """The median over seeds, and how many reached it."""
    found = curves.reached(values)
    median = "never" if math.isinf(found.median) else f"{found.median:,.0f}"
    return median if found.reached == found.n else f"{median} ({found.reached} of {found.n})"


def run_table(results: StudyResults, beside: Path | None) -> Table:
    """Every finished run.

    Args:
        results: results of a study.
        beside: folder of the page, for links; None makes no links.
    """
    tested = any(run.is_tested for run in results.runs)
    rows: list[tuple[TableCell, ...]] = []
    for run in results.runs:
        name: TableCell = run.name
        if beside is not None:
            name = Link.to_file(name, Path(os.path.relpath(run.path / CURVE, beside)))
        rows.append(
            (
                " · ".join(run.labels),
                str(run.seed),
                name,
                f"{run.best_return if run.is_tested else run.validation_return:.1f}",
                f"{_last_weights(run):.1f}",
                _known(run.worst_return, ".0f"),
                _known(run.landed, ".0%"),
                f"{run.hover_share:.0%}",
                f"{run.env_steps:,}",
                "never"
                if math.isinf(run.env_steps_to_solved)
                else f"{run.env_steps_to_solved:,.0f}",
                f"{run.seconds:.0f}",
            )
        )
    return Table(
        f"The {len(rows)} runs of this study.",
        (
            "level", "seed", "run", "test return" if tested else "validation return",
            "final weights", "worst flight", "landed", "timed out in training", "env steps",
            f"to {_solved_text(results)}", "seconds",
        ),
        tuple(rows),
        folded=True,
    )  # fmt: skip
