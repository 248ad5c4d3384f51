"""What a study found: the seeds of each level, and the interval of their mean."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator, PercentFormatter

from touchdown.figures import style
from touchdown.stats.seeds import SeedSummary, summarise_seeds
from touchdown.types import FloatArray

COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.RED)
_SEED: dict[str, Any] = {"s": 14, "alpha": 0.45, "linewidths": 0, "zorder": 2}
_WIDE = 30.0  # greatest position over the least from which an axis is logarithmic
_LEAST_SHOWN = -300.0  # return points: lower ones would squeeze all that matters


@dataclass(frozen=True, slots=True)
class Point:
    """One level on an axis."""

    position: float
    values: FloatArray
    """[n], a number a seed."""


@dataclass(frozen=True, slots=True)
class Row:
    """One level in a list."""

    label: str
    values: FloatArray
    """[n], a number a seed."""
    is_base: bool = False


def draw_over_axis(
    ax: Axes, lines: Mapping[str, Sequence[Point]], axis: str, base: float | None = None
) -> Axes:
    """Each line's means with their 95% intervals, and the seeds behind them.

    Args:
        ax: to draw on.
        lines: by name; "" is not named.
        axis: what the positions are.
        base: position of the level that the paper chose, marked; None marks none.
    """
    positions = sorted({point.position for points in lines.values() for point in points})
    scale = _scale_of(positions)
    ax.set_xscale(*scale[:1], **scale[1])
    if base is not None:
        ax.axvline(base, color=style.FAINT, linewidth=6, zorder=0)
    for (name, points), colour in zip(lines.items(), COLOURS, strict=False):
        at = [point.position for point in points]
        found = [summarise_seeds(point.values) for point in points]
        for point in points:
            ax.scatter([point.position] * len(point.values), point.values, color=colour, **_SEED)
        _errors(ax, at, found, colour, name)
    ax.set_xticks(positions, [_short(position) for position in positions])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xlabel(axis)
    if any(lines):
        style.legend_above(ax)
    return style.tidy(ax)


def _errors(
    ax: Axes, at: Sequence[float], found: Sequence[SeedSummary], colour: str, name: str
) -> None:
    means = np.array([each.mean.value for each in found])
    low = means - [each.mean.low for each in found]
    high = np.array([each.mean.high for each in found]) - means
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
    )


def draw_rows(ax: Axes, rows: Sequence[Row], lines: Mapping[str, float] | None = None) -> Axes:
    """A list of levels from the top: the seeds, their mean with its 95% interval.

    Args:
        ax: to draw on.
        rows: the levels.
        lines: numbers to compare with, by name, such as the PID's.
    """
    for place, row in enumerate(rows):
        colour = style.ORANGE if row.is_base else style.BLUE
        ax.scatter(row.values, [place] * len(row.values), color=colour, **_SEED)
        mean = summarise_seeds(row.values).mean
        ax.plot([mean.low, mean.high], [place, place], color=colour, linewidth=2.4, zorder=3)
        ax.plot([mean.value], [place], color=colour, marker="o", markersize=7, zorder=4)
        ax.annotate(
            f"{mean.value:.0f}" if abs(mean.value) >= 10 else f"{mean.value:.2g}",
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


def draw_map(
    ax: Axes,
    across: tuple[str, Sequence[str]],
    up: tuple[str, Sequence[str]],
    means: FloatArray,
    counts: FloatArray,
) -> Axes:
    """Two factors: the mean of each cell, as a colour and a number.

    Args:
        ax: to draw on.
        across: the name of the factor along x, and its levels.
        up: the name of the factor along y, and its levels.
        means: [levels up, levels across]; NaN where there is none.
        counts: seeds of each cell, of the same shape.
    """
    low, high = float(np.nanmin(means)), float(np.nanmax(means))
    ax.imshow(means, cmap="viridis", vmin=low, vmax=high, aspect="auto", origin="lower")
    for (y, x), mean in np.ndenumerate(means):
        if np.isnan(mean):
            continue
        bright = (mean - low) > 0.6 * (high - low)
        ax.annotate(
            f"{mean:.0f}\nn = {counts[y, x]:.0f}",
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
    ax: Axes, what: str, values: FloatArray, along: Literal["x", "y"], *, shares: bool = False
) -> Axes:
    """Name the axis of the numbers, and fit it to the seeds.

    The interval of few seeds that differ is wider than all that is worth seeing: it is cut off.

    Args:
        ax: to finish.
        what: the numbers are.
        values: all numbers drawn.
        along: which axis they are on.
        shares: whether they are shares, from 0 to 1, and not return points.
    """
    axis = ax.xaxis if along == "x" else ax.yaxis
    limit = ax.set_xlim if along == "x" else ax.set_ylim
    axis.set_label_text(what)
    least, most = float(values.min()), float(values.max())
    if shares:
        axis.set_major_formatter(PercentFormatter(1.0))
        limit(-0.02, min(1.05, 1.2 * max(0.1, most)))
        return ax
    least = max(_LEAST_SHOWN, least)
    room = max(0.12 * (most - least), 0.02 * abs(most), 1e-3)
    limit(least - room, most + room)
    return ax


def _scale_of(positions: Sequence[float]) -> tuple[str, dict[str, float]]:
    """Logarithmic where positions lie far apart; γ and ε's decay crowd towards 1."""
    greatest, least = positions[-1], min((p for p in positions if p > 0), default=1.0)
    if least > 0.5 and greatest < 1:
        return "function", {"functions": (_from_one, _to_one)}  # pyright: ignore[reportReturnType]
    if greatest / least >= _WIDE:
        return "symlog", {"linthresh": least}
    return "linear", {}


def _from_one(x: FloatArray) -> FloatArray:
    """How far below 1, in powers of ten, rising with x."""
    return -np.log10(np.maximum(1e-6, 1 - np.asarray(x, float)))


def _to_one(x: FloatArray) -> FloatArray:
    return 1 - 10.0 ** -np.asarray(x, float)


def _short(position: float) -> str:
    return f"{position / 1000:g}k" if position >= 1_000 else f"{position:g}"
