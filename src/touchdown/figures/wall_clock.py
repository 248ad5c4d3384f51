"""Returns over wall-clock time of several systems, with the range over their training seeds."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from touchdown.core.types import FloatArray
from touchdown.figures import style
from touchdown.lander.rules import SOLVED_RETURN

Held = tuple[Sequence[float], Sequence[float]]
"""Seconds at which a run switched to a new policy, in increasing order, and mean returns of these
policies; the last entry is the end of the run."""

_COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.RED, style.MUTED)
_POINTS = 400


def range_over_seeds(
    runs: Sequence[Held],
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Seconds from when all runs have a policy to the end of the last; mean, minimum and maximum.

    Args:
        runs: one per training seed. A policy counts until the next one, the last one to the end.
    """
    at = np.geomspace(max(s[0] for s, _ in runs), max(s[-1] for s, _ in runs), _POINTS)
    values = np.array(
        [np.asarray(r)[np.searchsorted(s, at * (1 + 1e-9), side="right") - 1] for s, r in runs]
    )
    return at, values.mean(axis=0), values.min(axis=0), values.max(axis=0)


def draw_wall_clock(
    ax: Axes, systems: Mapping[str, Sequence[Held]], solved: float = SOLVED_RETURN
) -> Axes:
    """Mean return of the current policy over seconds of training, shaded from minimum to maximum.

    Args:
        ax: the axes to draw on.
        systems: runs by system name.
        solved: return that counts as solved.
    """
    ax.set_xscale("log")
    for (name, runs), colour in zip(systems.items(), _COLOURS, strict=False):
        at, mean, least, most = range_over_seeds(runs)
        ax.fill_between(at, least, most, color=colour, alpha=0.15, linewidth=0)
        ax.plot(at, mean, color=colour, linewidth=1.8, label=name)
        ax.plot(at[-1:], mean[-1:], color=colour, marker="o", markersize=5)
    ax.axhline(solved, color=style.MUTED, linewidth=1, linestyle=(0, (4, 3)), zorder=1)
    ax.set_ylim(-400, 300)
    ax.set_ylabel("test return (greedy)")
    counts = sorted({len(runs) for runs in systems.values()})
    seeds = " to ".join(map(str, counts[:1] + counts[1:][-1:]))
    ax.set_xlabel(f"seconds of training; band: minimum to maximum over seeds ({seeds})")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    style.legend_above(ax)
    return style.tidy(ax)


def save_wall_clock(path: Path, systems: Mapping[str, Sequence[Held]]) -> None:
    """Draw the systems and write them as PNG.

    Raises:
        UserError: the file cannot be written.
    """
    figure = style.new_figure(7.2, 3.6)
    draw_wall_clock(figure.subplots(), systems)
    style.save(figure, path)
