"""A study's results: the seeds of each level, and the interval of their median."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator, PercentFormatter
from matplotlib.transforms import Transform, offset_copy
from numpy.typing import ArrayLike

from touchdown.core.types import FloatArray
from touchdown.figures import style
from touchdown.stats.location import median_interval
from touchdown.stats.summary import Interval

COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.RED)
_SEED: dict[str, Any] = {"s": 14, "alpha": 0.45, "linewidths": 0, "zorder": 2}
_WIDE = 30.0  # ratio of the largest to the smallest position from which an axis is logarithmic
_FACTORS = 4.0  # the same, for positions that are more even on a logarithmic axis
LANDER_RETURNS = (-300.0, 320.0)
"""What a figure of the lander's returns shows: wider intervals, and seeds that diverged, would
squeeze the rest."""
_BESIDE = 4.0  # typographic points between a median and its seeds


@dataclass(frozen=True, slots=True)
class Point:
    """One level on an axis."""

    position: float
    values: FloatArray
    """[n], one number per seed."""


@dataclass(frozen=True, slots=True)
class Row:
    """One level in a list."""

    label: str
    values: FloatArray
    """[n], one number per seed."""
    is_base: bool = False


def draw_over_axis(
    ax: Axes, lines: Mapping[str, Sequence[Point]], axis: str, base: float | None = None
) -> Axes:
    """Each line's medians with their 95% intervals, and the individual seeds.

    Args:
        ax: the axes to draw on.
        lines: lines by name; "" has no legend entry.
        axis: label of the x axis.
        base: position of the paper's level, which is marked; None marks none.
    """
    positions = sorted({point.position for points in lines.values() for point in points})
    scale = _scale_of(positions)
    ax.set_xscale(*scale[:1], **scale[1])
    if base is not None:
        ax.axvline(base, color=style.FAINT, linewidth=6, zorder=0)
    for i, ((name, points), colour) in enumerate(zip(lines.items(), COLOURS, strict=False)):
        aside = _BESIDE * 1.5 * (i - (len(lines) - 1) / 2)
        at = [point.position for point in points]
        found = [_median(point.values) for point in points]
        for point in points:
            ax.scatter(
                [point.position] * len(point.values),
                point.values,
                color=colour,
                transform=_moved(ax, aside + math.copysign(_BESIDE, aside)),
                **_SEED,
            )
        _errors(ax, at, found, colour, name, _moved(ax, aside))
    _fit(ax, positions)
    ax.set_xticks(positions, [_short(position) for position in positions])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xlabel(axis)
    if any(lines):
        style.legend_above(ax)
    return style.tidy(ax)


def _fit(ax: Axes, positions: Sequence[float]) -> None:
    """Leave room at both ends; matplotlib's own limits ignore offset points."""
    scale = ax.xaxis.get_transform()
    first, last = scale.transform([positions[0], positions[-1]])
    room = 0.06 * (last - first) or 1.0
    ax.set_xlim(*scale.inverted().transform([first - room, last + room]))


def _moved(ax: Axes, right: float = 0.0, down: float = 0.0) -> Transform:
    """The data transform, offset in typographic points, so that coinciding marks are visible."""
    return offset_copy(ax.transData, ax.get_figure(root=True), x=right, y=-down, units="points")


def _errors(
    ax: Axes,
    at: Sequence[float],
    found: Sequence[Interval],
    colour: str,
    name: str,
    transform: Transform,
) -> None:
    medians = np.array([each.value for each in found])
    low = medians - [each.low for each in found]
    high = np.array([each.high for each in found]) - medians
    ax.errorbar(
        at,
        medians,
        yerr=np.maximum(0, np.array([low, high])),
        color=colour,
        linewidth=1.6,
        elinewidth=1.6,
        capsize=3,
        marker="o",
        markersize=5,
        label=name or None,
        zorder=3,
        transform=transform,
    )


def draw_rows(
    ax: Axes,
    rows: Sequence[Row],
    lines: Mapping[str, float] | None = None,
    *,
    shares: bool = False,
) -> Axes:
    """A list of levels from the top: the seeds, and their median with its 95% interval.

    Args:
        ax: the axes to draw on.
        rows: the levels.
        lines: reference values by name, such as the PID's.
        shares: whether the numbers are shares, from 0 to 1.
    """
    for place, row in enumerate(rows):
        colour = style.ORANGE if row.is_base else style.BLUE
        ax.scatter(
            row.values,
            [place] * len(row.values),
            color=colour,
            transform=_moved(ax, down=2 * _BESIDE),
            **_SEED,
        )
        median = _median(row.values)
        ax.plot([median.low, median.high], [place, place], color=colour, linewidth=2.4, zorder=3)
        ax.plot([median.value], [place], color=colour, marker="o", markersize=7, zorder=4)
        ax.annotate(
            _label(median.value, shares=shares),
            (median.value, place),
            xytext=(0, 7),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            color=style.INK,
        )
    for name, value in (lines or {}).items():
        ax.axvline(value, color=style.MUTED, linewidth=1, linestyle=(0, (4, 3)), zorder=1)
        ax.annotate(
            name,
            (value, 1),
            xycoords=("data", "axes fraction"),
            xytext=(0, 3),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            color=style.MUTED,
        )
    ax.set_yticks(range(len(rows)), [row.label for row in rows])
    ax.set_ylim(len(rows) - 0.5, -0.6)
    ax = style.tidy(ax)
    ax.tick_params(axis="y", labelcolor=style.INK, labelsize=9, length=0)
    ax.grid(visible=False, axis="y")
    return ax


def _label(value: float, *, shares: bool) -> str:
    if shares:
        return f"{value:z.0%}"  # z: no -0
    return f"{value:z.0f}" if abs(value) >= 10 else f"{value:z.2g}"


def _median(values: FloatArray) -> Interval:
    """The median with its 95% interval; too few seeds have none, and just the median is drawn."""
    found = median_interval(values)
    if math.isinf(found.low) or math.isinf(found.high):
        return Interval(found.value, found.value, found.value)
    return found


def draw_map(
    ax: Axes,
    across: tuple[str, Sequence[str]],
    up: tuple[str, Sequence[str]],
    cells: Mapping[tuple[int, int], FloatArray],
    *,
    shares: bool = False,
) -> Axes:
    """A map of two factors: the median of each cell as a colour, and in text with its 95% interval.

    Args:
        ax: the axes to draw on.
        across: the name of the factor along x, and its levels.
        up: the name of the factor along y, and its levels.
        cells: [n], one number per seed, by the indices (up, across); at least one cell.
        shares: whether the numbers are shares, from 0 to 1.
    """
    found = {place: _median(values) for place, values in cells.items()}
    medians = np.full((len(up[1]), len(across[1])), np.nan)
    for place, median in found.items():
        medians[place] = median.value
    low, high = float(np.nanmin(medians)), float(np.nanmax(medians))
    ax.imshow(medians, cmap="viridis", vmin=low, vmax=high, aspect="auto", origin="lower")
    for (y, x), median in found.items():
        bright = (median.value - low) > 0.6 * (high - low)
        value, start, end = (
            _label(each, shares=shares) for each in (median.value, median.low, median.high)
        )
        interval = [f"{start} to {end}"] if median.low < median.high else []
        ax.annotate(
            "\n".join((value, *interval, f"n = {len(cells[y, x])}")),
            (float(x), float(y)),
            ha="center",
            va="center",
            fontsize=8,
            color=style.INK if bright else "white",
        )
    ax.set_xticks(range(len(across[1])), list(across[1]))
    ax.set_yticks(range(len(up[1])), list(up[1]))
    ax.set_xlabel(across[0])
    ax.set_ylabel(up[0])
    ax = style.tidy(ax)
    ax.grid(visible=False)
    return ax


def finish(
    ax: Axes,
    what: str,
    groups: Sequence[FloatArray],
    along: Literal["x", "y"],
    *,
    others: Sequence[float] = (),
    shares: bool = False,
    shown: tuple[float, float] | None = None,
) -> Axes:
    """Label the axis of the numbers, and fit its limits to the seeds.

    Args:
        ax: the axes to finish.
        what: label of the axis.
        groups: the numbers of each level, one per seed, at least one.
        along: the axis of the numbers.
        others: other numbers that must be visible, such as a baseline's.
        shares: whether the numbers are shares, from 0 to 1, rather than return points.
        shown: limits of the axis; `mark_beyond` counts the seeds beyond them. None shows all.
    """
    axis = ax.xaxis if along == "x" else ax.yaxis
    limit = ax.set_xlim if along == "x" else ax.set_ylim
    axis.set_label_text(what)
    least = min(*(float(group.min()) for group in groups), *others, math.inf)
    most = max(*(float(group.max()) for group in groups), *others, -math.inf)
    if shares:
        axis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        limit(-0.02, min(1.05, 1.1 * max(0.1, most)))
        return ax
    if shown is not None:
        least, most = np.clip((least, most), *shown)  # also if all seeds are beyond them
    room = max(0.05 * (most - least), 0.02 * abs(most), 1e-3)
    limit(least - room, most + room)
    return ax


def mark_beyond(
    ax: Axes, at: Sequence[float], groups: Sequence[FloatArray], along: Literal["x", "y"]
) -> None:
    """Count the seeds beyond the limits of the axis, at its ends.

    Args:
        ax: finished axes.
        at: the place of each level on the other axis.
        groups: the numbers of each level, one per seed.
        along: the axis of the numbers.
    """
    low, high = ax.get_xlim() if along == "x" else ax.get_ylim()
    beyond: dict[tuple[float, float], list[float]] = {}
    for place, group in zip(at, groups, strict=True):
        for value in group.tolist():
            if not low <= value <= high:
                beyond.setdefault((place, low if value < low else high), []).append(value)
    for (place, end), values in beyond.items():
        is_low = end == low
        marker = {("x", True): "<", ("x", False): ">", ("y", True): "v", ("y", False): "^"}
        x, y = (end, place) if along == "x" else (place, end)
        below = _moved(ax, down=2 * _BESIDE) if along == "x" else ax.transData
        ax.plot(
            [x],
            [y],
            marker=marker[along, is_low],
            color=style.RED,
            markersize=5,
            clip_on=False,
            zorder=5,
            transform=below,
        )
        furthest = min(values) if is_low else max(values)
        text = f"{len(values)} to {furthest:.0f}" if len(values) > 1 else f"{furthest:.0f}"
        inwards = 6 if is_low else -6
        ax.annotate(
            text,
            (x, y),
            xytext=(inwards, -2 * _BESIDE) if along == "x" else (0, inwards),
            textcoords="offset points",
            ha=("left" if is_low else "right") if along == "x" else "center",
            va="center" if along == "x" else "bottom" if is_low else "top",
            fontsize=7,
            color=style.RED,
        )


def _scale_of(positions: Sequence[float]) -> tuple[str, dict[str, float]]:
    """Logarithmic if positions are far apart or grow by factors; γ by its distance from 1."""
    greatest, least = positions[-1], min((p for p in positions if p > 0), default=1.0)
    if least > 0.5 and greatest < 1:
        return "function", {"functions": (_from_one, _to_one)}  # pyright: ignore[reportReturnType]
    steps = [p for p in positions if p >= least]
    by_factors = greatest / least >= _FACTORS and _unevenness(np.log(steps)) < _unevenness(steps)
    if by_factors or greatest / least >= _WIDE:
        return "symlog", {"linthresh": least}
    return "linear", {}


def _unevenness(positions: ArrayLike) -> float:
    """Spread of the distances between neighbours, in units of their mean; ∞ with fewer than two."""
    gaps = np.diff(np.asarray(positions, float))
    return float(np.std(gaps) / np.mean(gaps)) if len(gaps) > 1 else math.inf


def _from_one(x: FloatArray) -> FloatArray:
    """Distance below 1 in powers of ten, increasing with x."""
    return -np.log10(np.maximum(1e-6, 1 - np.asarray(x, float)))


def _to_one(x: FloatArray) -> FloatArray:
    return 1 - 10.0 ** -np.asarray(x, float)


def _short(position: float) -> str:
    return f"{position / 1000:g}k" if position >= 1_000 else f"{position:g}"
