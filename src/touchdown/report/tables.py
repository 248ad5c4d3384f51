"""The tables of a study: its levels compared, its claims, its runs."""

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from touchdown.envs.custom import threshold_of
from touchdown.report.page import ClaimRow, Link, Table, TableCell
from touchdown.runs.run import CURVE
from touchdown.stats.curves import Reached
from touchdown.stats.summary import Interval
from touchdown.studies.claims import Decision
from touchdown.studies.findings import p_text
from touchdown.studies.levels import LevelSummary, summarise_levels
from touchdown.studies.metrics import METRICS, formatter, is_share
from touchdown.studies.results import StudyResults

_NONE = "–"


def claim_rows(decisions: Sequence[Decision]) -> tuple[ClaimRow, ...]:
    """Claims with their verdicts, for the page."""
    return tuple(
        ClaimRow(d.claim.sentence, d.claim.section, d.verdict, d.evidence) for d in decisions
    )


def _points(value: float) -> str:
    return f"{value:z.0f}"  # z: no -0


def _known(value: float, spec: str) -> str:
    """A number, or a dash if the run was not tested."""
    return _NONE if math.isnan(value) else format(value, spec)


def interval_text(found: Interval, text_of: Callable[[float], str] = _points) -> str:
    """A number with its interval; a single value has none, and too few seeds have none.

    Args:
        found: the number and its interval.
        text_of: formats each number; by default as return points.
    """
    if found.low == found.high or math.isinf(found.low) or math.isinf(found.high):
        return text_of(found.value)
    return f"{text_of(found.value)} [{text_of(found.low)}, {text_of(found.high)}]"


def level_tables(results: StudyResults, metric: str) -> tuple[Table, ...]:
    """The numbers of each cell's seeds: the comparison with the base, and a folded table of others.

    Args:
        results: results of a study.
        metric: the metric to summarise and compare.
    """
    levels = summarise_levels(results, metric)
    text_of = formatter(metric, [np.array(level.seeds.values) for level in levels])
    shows_training = not is_share(metric)
    names = [f"{level.cell.name} (base)" if level.is_base else level.cell.name for level in levels]
    compared = Table(
        f"{METRICS[metric].capitalize()}, by level; against the base: typical "
        "difference [95%], p by Holm's correction, probability that a seed has more.",
        ("level", "n", "median [95%]", "against base", "p", "P(more)", "mean [95%]", "IQM [95%]"),
        tuple(
            (
                name,
                str(level.seeds.n),
                interval_text(level.median, text_of),
                *_against_base(level, text_of),
                interval_text(level.seeds.mean, text_of),
                interval_text(level.seeds.iqm, text_of),
            )
            for name, level in zip(names, levels, strict=True)
        ),
    )
    others = Table(
        "Spread over seeds and training, by level.",
        ("level", "band of seeds", *(_training_columns(results) if shows_training else ())),
        tuple(
            (
                name,
                _NONE if level.seeds.band is None else " to ".join(map(text_of, level.seeds.band)),
                *(_training_cells(level, text_of) if shows_training else ()),
            )
            for name, level in zip(names, levels, strict=True)
        ),
        folded=True,
    )
    return compared, others


def _against_base(level: LevelSummary, text_of: Callable[[float], str]) -> tuple[str, str, str]:
    """The difference, p and the probability of improvement; dashes without a comparison."""
    if level.against_base is None:
        return _NONE, _NONE, _NONE
    found = level.against_base.comparison
    return (
        f"{'+' * (found.difference.value > 0)}{interval_text(found.difference, text_of)}",
        p_text(level.against_base.p_corrected),
        f"{found.probability_of_improvement.value:.0%}",
    )


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


def _training_cells(level: LevelSummary, text_of: Callable[[float], str]) -> tuple[str, ...]:
    """Statistics of training for a level's seeds."""
    return (
        text_of(level.last_weights),
        text_of(level.over_training),
        _to_solved(level.env_steps_to_solved),
        _to_solved(level.seconds_to_solved),
    )


def _to_solved(found: Reached) -> str:
    """The median over seeds, and how many seeds reached the threshold."""
    median = "never" if math.isinf(found.median) else f"{found.median:,.0f}"
    return median if found.reached == found.n else f"{median} ({found.reached} of {found.n})"


def run_table(results: StudyResults, beside: Path | None) -> Table:
    """Every finished run.

    Args:
        results: results of a study.
        beside: folder of the page, for links; None makes no links.
    """
    tested = any(run.is_tested for run in results.runs)
    lands = any(math.isfinite(run.landed) for run in results.runs)
    rows: list[tuple[TableCell, ...]] = []
    for run in results.runs:
        name: TableCell = run.name
        if beside is not None and (run.path / CURVE).is_file():  # not of an imported run
            name = Link.to_file(name, Path(os.path.relpath(run.path / CURVE, beside)))
        rows.append(
            (
                " · ".join(run.labels),
                str(run.seed),
                name,
                f"{run.best_return if run.is_tested else run.validation_return:.1f}",
                f"{run.return_of_last:.1f}",
                _known(run.worst_return, ".0f"),
                *[_known(run.landed, ".0%")] * lands,
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
            "final weights", "worst episode", *["landed"] * lands, "timed out in training",
            "env steps",
            f"to {_solved_text(results)}", "seconds",
        ),
        tuple(rows),
        folded=True,
    )  # fmt: skip
