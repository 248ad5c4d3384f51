"""A study's results: the seeds of each level, and the interval of their mean."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator, PercentFormatter
from matplotlib.transforms import Transform, offset_copy

from touchdown.core.types import FloatArray
from touchdown.figures import style
from touchdown.stats.seeds import mean_interval
from touchdown.stats.summary import Interval

COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.RED)
_SEED: dict[str, Any] = {"s": 14, "alpha": 0.45, "linewidths": 0, "zorder": 2}
_WIDE = 30.0  # ratio of the largest to the smallest position from which an axis is logarithmic
LANDER_RETURNS = (-300.0, 320.0)
"""What a figure of the lander's returns shows: wider intervals, and seeds that diverged, would
squeeze the rest."""
_BESIDE = 4.0  # typographic points between a mean and its seeds


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
    """Each line's means with their 95% intervals, and the individual seeds.

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
        found = [mean_interval(point.values) for point in points]
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
    means = np.array([each.value for each in found])
    low = means - [each.low for each in found]
    high = np.array([each.high for each in found]) - means
    ax.errorbar(
        at,
        means,
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
    """A list of levels from the top: the seeds, and their mean with its 95% interval.

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
        mean = mean_interval(row.values)
        ax.plot([mean.low, mean.high], [place, place], color=colour, linewidth=2.4, zorder=3)
        ax.plot([mean.value], [place], color=colour, marker="o", markersize=7, zorder=4)
        ax.annotate(
            _label(mean.value, shares=shares),
            (mean.value, place),
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


def _label(mean: float, *, shares: bool) -> str:
    if shares:
        return f"{mean:z.0%}"  # z: no -0
    return f"{mean:z.0f}" if abs(mean) >= 10 else f"{mean:z.2g}"


def draw_map(
    ax: Axes,
    across: tuple[str, Sequence[str]],
    up: tuple[str, Sequence[str]],
    cells: Mapping[tuple[int, int], FloatArray],
    *,
    shares: bool = False,
) -> Axes:
    """A map of two factors: the mean of each cell as a colour, and in text with its 95% interval.

    Args:
        ax: the axes to draw on.
        across: the name of the factor along x, and its levels.
        up: the name of the factor along y, and its levels.
        cells: [n], one number per seed, by the indices (up, across); at least one cell.
        shares: whether the numbers are shares, from 0 to 1.
    """
    found = {place: mean_interval(values) for place, values in cells.items()}
    means = np.full((len(up[1]), len(across[1])), np.nan)
    for place, mean in found.items():
        means[place] = mean.value
    low, high = float(np.nanmin(means)), float(np.nanmax(means))
    ax.imshow(means, cmap="viridis", vmin=low, vmax=high, aspect="auto", origin="lower")
    for (y, x), mean in found.items():
        bright = (mean.value - low) > 0.6 * (high - low)
        value, start, end = (
            _label(each, shares=shares) for each in (mean.value, mean.low, mean.high)
        )
        ax.annotate(
            f"{value}\n{start} to {end}\nn = {len(cells[y, x])}",
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
    """Label the axis of the numbers, and fit its limits to the seeds and their intervals.

    The interval of a few differing seeds can be far wider than the data, so it is cut off.

    Args:
        ax: the axes to finish.
        what: label of the axis.
        groups: the numbers of each level, one per seed, at least one.
        along: the axis of the numbers.
        others: other numbers that must be visible, such as a baseline's.
        shares: whether the numbers are shares, from 0 to 1, rather than return points.
        shown: limits of the axis; numbers beyond them are cut off. None shows all seeds, with at
            most the width of their range on each side.
    """
    axis = ax.xaxis if along == "x" else ax.yaxis
    limit = ax.set_xlim if along == "x" else ax.set_ylim
    axis.set_label_text(what)
    means = [mean_interval(group) for group in groups]
    first = min(*(float(group.min()) for group in groups), *others, math.inf)
    last = max(*(float(group.max()) for group in groups), *others, -math.inf)
    least = min(first, *(mean.low for mean in means))
    most = max(last, *(mean.high for mean in means))
    if shares:
        axis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        limit(-0.02, min(1.05, 1.1 * max(0.1, most)))
        return ax
    lowest, highest = shown or (2 * first - last, 2 * last - first)
    least, most = max(lowest, least), min(highest, most)
    room = max(0.05 * (most - least), 0.02 * abs(most), 1e-3)
    limit(least - room, most + room)
    return ax


def _scale_of(positions: Sequence[float]) -> tuple[str, dict[str, float]]:
    """Logarithmic if positions are far apart, by distance from 1 for γ and the decay of ε."""
    greatest, least = positions[-1], min((p for p in positions if p > 0), default=1.0)
    if least > 0.5 and greatest < 1:
        return "function", {"functions": (_from_one, _to_one)}  # pyright: ignore[reportReturnType]
    if greatest / least >= _WIDE:
        return "symlog", {"linthresh": least}
    return "linear", {}


def _from_one(x: FloatArray) -> FloatArray:
    """Distance below 1 in powers of ten, increasing with x."""
    return -np.log10(np.maximum(1e-6, 1 - np.asarray(x, float)))


def _to_one(x: FloatArray) -> FloatArray:
    return 1 - 10.0 ** -np.asarray(x, float)


def _short(position: float) -> str:
    return f"{position / 1000:g}k" if position >= 1_000 else f"{position:g}"
