"""What a report says of one study: its figure, its claims, its levels compared, its runs."""

import itertools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from touchdown.figures import rungs, style
from touchdown.figures import studies as figures
from touchdown.figures.studies import Point, Row
from touchdown.report.page import Cell, ClaimRow, Link, Picture, Table
from touchdown.runs.run import CURVE
from touchdown.stats import compare, curves
from touchdown.stats.seeds import summarise_seeds
from touchdown.stats.summary import Interval
from touchdown.studies.claims import Decision, p_text
from touchdown.studies.plan import Level
from touchdown.studies.results import METRICS, StudyResults

_NONE = "–"
_TRAINING = ("last weights", "over training", "observations to 200", "seconds to 200")


def claim_rows(decisions: Sequence[Decision]) -> tuple[ClaimRow, ...]:
    """Claims with their verdicts, as the page shows them."""
    return tuple(
        ClaimRow(d.claim.sentence, d.claim.section, d.verdict, d.evidence) for d in decisions
    )


def _points(value: float) -> str:
    return f"{value:.0f}"


def _percent(value: float) -> str:
    return f"{value:.1%}"


def interval_text(found: Interval, told: Callable[[float], str] = _points) -> str:
    """A number with its interval, in return points unless told otherwise."""
    return f"{told(found.value)} [{told(found.low)}, {told(found.high)}]"


def level_table(results: StudyResults, metric: str = "best_return") -> Table:
    """Each cell's seeds in numbers, and against the base.

    Args:
        results: of a study.
        metric: what is compared.
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
    told = _percent if is_share(metric) else _points
    rows: list[tuple[Cell, ...]] = []
    for cell in cells:
        seeds = summarise_seeds(results.values(cell.labels, metric))
        comparison = known.get(cell.labels)
        against = (
            (_NONE,) * 3
            if comparison is None
            else (
                f"{'+' * (comparison.difference.value > 0)}{told(comparison.difference.value)}",
                f"{comparison.probability_of_improvement.value:.0%}",
                p_text(corrected[cell.labels]),
            )
        )
        rows.append(
            (
                f"{cell.name} (base)" if cell.labels == base.labels else cell.name,
                str(seeds.n),
                interval_text(seeds.iqm, told),
                interval_text(seeds.mean, told),
                _NONE if seeds.band is None else " to ".join(map(told, seeds.band)),
                *(() if is_share(metric) else _training_cells(results, cell.labels)),
                *against,
            )
        )
    return Table(
        f"{METRICS[metric].capitalize()}, by level; against the base: difference of means, "
        "probability that a seed has more, p by Holm's correction.",
        (
            "level", "n", "IQM [95%]", "mean [95%]", "band of seeds",
            *(() if is_share(metric) else _TRAINING),
            "against base", "P(more)", "p",
        ),
        tuple(rows),
    )  # fmt: skip


def is_share(metric: str) -> bool:
    """Whether a metric's numbers are shares, from 0 to 1, and not return points."""
    return metric.endswith("_share")


def _training_cells(results: StudyResults, labels: tuple[str, ...]) -> tuple[str, ...]:
    """How a level's seeds got to their return."""
    runs = results.of(labels)
    return (
        _points(float(np.mean(results.values(labels, "last_return")))),
        _points(float(np.mean(results.values(labels, "area")))),
        _to_solved([run.observations_to_solved for run in runs]),
        _to_solved([run.seconds_to_solved for run in runs]),
    )


def _to_solved(values: Sequence[float]) -> str:
    """The median over seeds, and how many got there."""
    found = curves.reached(values)
    median = "never" if math.isinf(found.median) else f"{found.median:,.0f}"
    return median if found.reached == found.n else f"{median} ({found.reached} of {found.n})"


def run_table(results: StudyResults, beside: Path | None) -> Table:
    """Every finished run.

    Args:
        results: of a study.
        beside: folder of the page, to link from; None links nothing.
    """
    rows: list[tuple[Cell, ...]] = []
    for run in results.runs:
        name: Cell = run.name
        if beside is not None:
            name = Link.to_file(name, Path(os.path.relpath(run.path / CURVE, beside)))
        rows.append(
            (
                " · ".join(run.labels),
                str(run.seed),
                name,
                f"{run.best_return:.1f}",
                f"{run.last_return:.1f}",
                f"{run.worst_return:.0f}",
                f"{run.landed:.0%}",
                f"{run.hover_share:.0%}",
                f"{run.observations:,}",
                "never"
                if math.isinf(run.observations_to_solved)
                else f"{run.observations_to_solved:,.0f}",
                f"{run.seconds:.0f}",
            )
        )
    return Table(
        f"The {len(rows)} runs of this study.",
        (
            "level", "seed", "run", "test return", "last weights", "worst flight", "landed",
            "hovered in training", "observations", "to 200", "seconds",
        ),
        tuple(rows),
        folded=True,
    )  # fmt: skip


def save_picture(
    title: str, results: StudyResults, metric: str, lines: Mapping[str, float], stem: Path
) -> Picture:
    """Draw a study's levels, as its factors ask for.

    Args:
        title: what the picture is about.
        results: of a study.
        metric: what is shown.
        lines: numbers to compare with, by name; only lists of levels show them.
        stem: path without its suffix.
    """
    study = results.study
    shares = is_share(metric)
    if len(study.factors) == 2:
        _draw_map(results, metric, stem)
    elif all(level.position is not None for level in study.factors[0].levels):
        figure = style.new_figure(7.2, 3.6)
        series = _series(results, metric)
        ax = figures.draw_over_axis(
            figure.subplots(),
            series,
            study.factors[0].name,
            _position_of(study.factors[0].levels, study.base_cell().labels[0]),
        )
        groups = [point.values for points in series.values() for point in points]
        figures.finish(ax, METRICS[metric], groups, "y", shares=shares)
        _save(figure, stem)
    else:
        found = [
            Row(cell.name, results.values(cell.labels, metric), cell == study.base_cell())
            for cell in study.cells()
            if results.of(cell.labels)
        ]
        save_rows(found, METRICS[metric], stem, lines, shares=shares)
    seeds = sorted({len(results.of(cell.labels)) for cell in study.cells()} - {0})
    count = " to ".join(map(str, seeds[:1] + seeds[1:][-1:]))
    return Picture(
        stem.with_suffix(".svg"),
        stem.with_suffix(".png"),
        f"{title}: {METRICS[metric]} of each level",
        f"{METRICS[metric].capitalize()}; mean with its 95% interval over n = {count} training "
        "seeds, the seeds behind it.",
    )


def save_rows(
    rows: Sequence[Row],
    what: str,
    stem: Path,
    lines: Mapping[str, float] | None = None,
    *,
    shares: bool = False,
    from_zero: bool = False,
) -> None:
    """Draw a list of levels, those of which there are numbers.

    Args:
        rows: the levels.
        what: the numbers are.
        stem: path without its suffix.
        lines: numbers to compare with, by name.
        shares: whether they are shares, from 0 to 1.
        from_zero: whether their axis begins at 0.
    """
    figure = style.new_figure(7.2, 0.9 + 0.5 * len(rows))
    known = [row for row in rows if len(row.values)]
    ax = figures.draw_rows(figure.subplots(), known, lines, shares=shares)
    others = tuple((lines or {}).values())
    groups = [row.values for row in known]
    figures.finish(ax, what, groups, "x", others=others, shares=shares)
    if from_zero:
        ax.set_xlim(left=0)
    _save(figure, stem)


def _save(figure: Figure, stem: Path) -> None:
    style.save(figure, stem.with_suffix(".png"), stem.with_suffix(".svg"))


def save_curves(title: str, results: StudyResults, of: str, stem: Path) -> Picture:
    """Draw a study's levels over training.

    Args:
        title: what the picture is about.
        results: of a study with at most as many levels as there are colours.
        of: `validations` or `hovering`.
        stem: path without its suffix.
    """
    by_level = {
        cell.name: [getattr(run, of) for run in results.of(cell.labels)]
        for cell in results.study.cells()
        if results.of(cell.labels)
    }
    figure = style.new_figure(7.2, 3.8)
    ax = figure.subplots()
    if of == "hovering":
        rungs.draw_shares(ax, by_level, "episodes of 1000 steps in training")
        caption = "Share of the training episodes that ran all their 1000 steps"
    else:
        rungs.draw_rungs(ax, by_level)
        caption = "Validation return, greedy, over training"
    _save(figure, stem)
    return Picture(
        stem.with_suffix(".svg"),
        stem.with_suffix(".png"),
        f"{title}: {caption.lower()}, a line a level",
        f"{caption}; mean over training seeds, shaded by its 95% interval.",
    )


def _series(results: StudyResults, metric: str) -> dict[str, list[Point]]:
    lines: dict[str, list[Point]] = {}
    for level in results.study.factors[0].levels:
        values = results.values((level.label,), metric)
        if len(values) and level.position is not None:
            lines.setdefault(level.series, []).append(Point(level.position, values))
    return lines


def _position_of(levels: Sequence[Level], label: str) -> float | None:
    return next(level.position for level in levels if level.label == label)


def _draw_map(results: StudyResults, metric: str, stem: Path) -> None:
    up, across = results.study.factors
    places = itertools.product(range(len(up.levels)), range(len(across.levels)))
    groups = [results.values(cell.labels, metric) for cell in results.study.cells()]
    cells = {place: group for place, group in zip(places, groups, strict=True) if len(group)}
    figure = style.new_figure(5.4, 3.8)
    figures.draw_map(
        figure.subplots(),
        (across.name, results.study.labels(1)),
        (up.name, results.study.labels(0)),
        cells,
    )
    _save(figure, stem)
