"""The pictures of a study: its levels compared, and over training."""

import itertools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from touchdown.config.ladder import BUILDS_ON
from touchdown.envs.custom import threshold_of
from touchdown.figures import rungs, style
from touchdown.figures import studies as figures
from touchdown.figures.studies import Point, Row
from touchdown.lander import rules
from touchdown.report.page import Picture
from touchdown.studies.metrics import METRICS, is_return, is_share
from touchdown.studies.plan import Cell, Level
from touchdown.studies.results import StudyResults
from touchdown.studies.run_lines import Curve

_TRAINING = {
    "training_returns": "mean return of training episodes",
    "training_steps": "mean steps of training episodes",
}


def save_picture(
    title: str, results: StudyResults, metric: str, lines: Mapping[str, float], stem: Path
) -> Picture:
    """Draw a study's levels: a map of two factors, values along an axis, or a list of levels.

    Args:
        title: title of the picture.
        results: results of a study.
        metric: metric that is shown.
        lines: reference values by name, shown only in lists of levels.
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
        points = [point for of_line in series.values() for point in of_line]
        groups = [point.values for point in points]
        shown = _lander_or_all(results, figures.LANDER_RETURNS) if is_return(metric) else None
        figures.finish(ax, METRICS[metric], groups, "y", shares=shares, shown=shown)
        figures.mark_beyond(ax, [point.position for point in points], groups, "y")
        _save(figure, stem)
    else:
        found = [
            Row(cell.name, results.values(cell.labels, metric), cell == study.base_cell())
            for cell in study.cells()
            if results.of(cell.labels)
        ]
        shown = _lander_or_all(results, figures.LANDER_RETURNS) if is_return(metric) else None
        save_rows(found, METRICS[metric], stem, lines, shares=shares, shown=shown)
    seeds = sorted({len(results.of(cell.labels)) for cell in study.cells()} - {0})
    count = " to ".join(map(str, seeds[:1] + seeds[1:][-1:]))
    return Picture(
        stem.with_suffix(".svg"),
        stem.with_suffix(".png"),
        f"{title}: {METRICS[metric]} of each level",
        f"{METRICS[metric].capitalize()}; median with its 95% interval over n = {count} training "
        "seeds; each dot is a seed.",
    )


def save_rows(
    rows: Sequence[Row],
    what: str,
    stem: Path,
    lines: Mapping[str, float] | None = None,
    *,
    shares: bool = False,
    from_zero: bool = False,
    shown: tuple[float, float] | None = None,
) -> None:
    """Draw a list of levels; those without numbers are left out.

    Args:
        rows: the levels.
        what: description of the numbers.
        stem: path without its suffix.
        lines: numbers to compare with, by name.
        shares: whether they are shares, from 0 to 1.
        from_zero: whether their axis begins at 0.
        shown: limits of the axis; seeds beyond them are counted at its ends. None shows all.
    """
    figure = style.new_figure(7.2, 0.9 + 0.5 * len(rows))
    known = [row for row in rows if len(row.values)]
    ax = figures.draw_rows(figure.subplots(), known, lines, shares=shares)
    others = tuple((lines or {}).values())
    groups = [row.values for row in known]
    figures.finish(ax, what, groups, "x", others=others, shares=shares, shown=shown)
    figures.mark_beyond(ax, range(len(known)), groups, "x")
    if from_zero:
        ax.set_xlim(left=0)
    _save(figure, stem)


def _save(figure: Figure, stem: Path) -> None:
    style.save(figure, stem.with_suffix(".png"), stem.with_suffix(".svg"))


def save_all_curves(title: str, results: StudyResults, of: str, stem: Path) -> list[Picture]:
    """Draw a study's levels over training: in one picture or, if they are too many, one per level.

    The base of a rung of the ladder is the rung that it builds on, if the study has it; the base of
    other levels is the study's.

    Args:
        title: title of the pictures.
        results: results of a study.
        of: `validations` or `hovering`.
        stem: path of a single picture without its suffix; part of the names of several.
    """
    cells = _with_runs(results)
    if len(cells) <= rungs.MAX_CURVES:
        return [_save_curves(title, results, cells, of, stem)]
    found: list[Picture] = []
    for cell in cells:
        base = _base_of(cell, cells, results.study.base_cell())
        shown = [base] * (cell != base and base in cells) + [cell]
        own = stem.with_name(f"{stem.name}-{re.sub(r'[^A-Za-z0-9_-]+', '-', cell.name)}")
        found.append(_save_curves(f"{title}, {cell.name}", results, shown, of, own))
    return found


def save_panels(title: str, results: StudyResults, stem: Path) -> Picture:
    """Draw the validations of each level of one factor over training, beside the base's.

    Args:
        title: title of the picture.
        results: results of a study.
        stem: path without its suffix.
    """
    cells = _with_runs(results)
    by_level = _curves(results, cells, "validations")
    rows = -(-len(cells) // rungs.PANELS_IN_A_ROW)
    figure = style.new_figure(7.2, 0.8 + 1.7 * rows)
    rungs.draw_panels(
        figure,
        by_level,
        results.study.base_cell().name,
        _threshold_of(cells),
        _lander_or_all(results, rungs.LANDER_RETURNS),
    )
    return _saved(
        figure,
        stem,
        f"{title}: validation return over training, a panel per level",
        f"Validation return during training by {results.study.factors[0].name}, with the base in "
        f"grey; {rungs.caption(by_level)}.",
    )


def save_reached(title: str, results: StudyResults, stem: Path) -> list[Picture]:
    """Draw how many seeds of each level have reached the environment's threshold, over training.

    Args:
        title: title of the picture.
        results: results of a study.
        stem: path without its suffix.

    Returns:
        The picture; none if the levels have no threshold in common.
    """
    cells = _with_runs(results)
    threshold = _threshold_of(cells)
    if threshold is None:
        return []
    times = {cell.name: results.values(cell.labels, "env_steps_to_solved") for cell in cells}
    end = max(run.env_steps for run in results.runs)
    figure = style.new_figure(7.2, 3.8)
    rungs.draw_reached(figure.subplots(), times, end, f"seeds that have reached {threshold:g}")
    return [
        _saved(
            figure,
            stem,
            f"{title}: share of seeds that have reached {threshold:g} over training",
            f"Share of training seeds of which a validation has reached {threshold:g} (Kaplan & "
            "Meier's estimate), by level; the legend counts the seeds that did by the end.",
        )
    ]


def save_training(title: str, results: StudyResults, of: str, stem: Path) -> Picture:
    """Draw a number of the training episodes of each level over training.

    Args:
        title: title of the picture.
        results: results of a study with at most `rungs.MAX_CURVES` levels.
        of: `training_returns` or `training_steps`.
        stem: path without its suffix.
    """
    what = _TRAINING[of]
    by_level = _curves(results, _with_runs(results), of)
    figure = style.new_figure(7.2, 3.8)
    shown = _lander_or_all(results, rungs.LANDER_RETURNS) if of == "training_returns" else None
    rungs.draw_numbers(figure.subplots(), by_level, what, shown)
    return _saved(
        figure,
        stem,
        f"{title}: {what}, one line per level",
        f"{what[0].upper()}{what[1:]}, as in the paper's figures: {', '.join(by_level)}; "
        f"{rungs.caption(by_level)}.",
    )


def _saved(figure: Figure, stem: Path, alt: str, caption: str) -> Picture:
    """Save a figure as SVG and PNG."""
    _save(figure, stem)
    return Picture(stem.with_suffix(".svg"), stem.with_suffix(".png"), alt, caption)


def _with_runs(results: StudyResults) -> list[Cell]:
    return [cell for cell in results.study.cells() if results.of(cell.labels)]


def _curves(results: StudyResults, cells: Sequence[Cell], of: str) -> dict[str, list[Curve]]:
    """A curve of each run by the name of its cell; `of` is a field of `RunResult`."""
    return {cell.name: [getattr(run, of) for run in results.of(cell.labels)] for cell in cells}


def _threshold_of(cells: Sequence[Cell]) -> float | None:
    """The threshold that all cells have in common."""
    thresholds = {threshold_of(cell.config.env_id) for cell in cells}
    return thresholds.pop() if len(thresholds) == 1 else None


def _base_of(cell: Cell, cells: Sequence[Cell], base: Cell) -> Cell:
    below = BUILDS_ON.get(cell.name)
    return next((other for other in cells if other.name == below), base)


def _save_curves(
    title: str, results: StudyResults, cells: Sequence[Cell], of: str, stem: Path
) -> Picture:
    by_level = _curves(results, cells, of)
    figure = style.new_figure(7.2, 3.8)
    ax = figure.subplots()
    if of == "hovering":
        rungs.draw_shares(ax, by_level, "episodes of 1000 steps in training")
        caption = "Share of training episodes that ran all 1000 steps"
    else:
        rungs.draw_rungs(
            ax,
            by_level,
            _threshold_of(cells),
            _lander_or_all(results, rungs.LANDER_RETURNS),
        )
        caption = "Validation return during training"
    return _saved(
        figure,
        stem,
        f"{title}: {caption.lower()}, one line per level",
        f"{caption}: {', '.join(by_level)}; {rungs.caption(by_level)}.",
    )


def _lander_or_all(
    results: StudyResults, lander: tuple[float, float]
) -> tuple[float, float] | None:
    """Limits of the returns in a picture; None, for all of them, in other environments."""
    of_lander = all(rules.is_lander(cell.config.env_id) for cell in results.study.cells())
    return lander if of_lander else None


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
        shares=is_share(metric),
    )
    _save(figure, stem)
