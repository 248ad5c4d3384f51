"""Algorithms by their score and by how much they depend on their settings."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from touchdown.figures import style
from touchdown.stats.sensitivity import Sensitivity

_ROOM_ACROSS, _ROOM_UP = 0.15, 0.08  # of a name, as shares of the axes


def draw_sensitivity(ax: Axes, found: Mapping[str, Sensitivity], base: str) -> Axes:
    """A plane: up, the score with settings for each environment; to the right, what they gain.

    On the diagonal line, the score with shared settings is that of the base.

    Args:
        ax: the axes to draw on.
        found: algorithms by name, at least one.
        base: name of the algorithm that the others are compared with.
    """
    for name, of in found.items():
        colour = style.ORANGE if name == base else style.BLUE
        x, y = of.sensitivity, float(np.mean(of.tuned))
        gains = of.tuned - of.shared
        ax.scatter(gains, of.tuned, color=colour, s=14, alpha=0.45, linewidths=0, zorder=2)
        for gain, tuned in zip(gains, of.tuned, strict=True):
            ax.plot([x, gain], [y, tuned], color=colour, linewidth=0.8, alpha=0.3, zorder=2)
        ax.plot([x], [y], color=colour, marker="o", markersize=7, zorder=4)
    x, y = found[base].sensitivity, float(np.mean(found[base].tuned))
    ax.axline(
        (x, y),
        slope=1,
        color=style.MUTED,
        linewidth=1,
        linestyle=(0, (4, 3)),
        zorder=1,
        label=f"same score as {base} with shared settings; above the line, a higher one",
    )
    ax.axhline(y, color=style.FAINT, linewidth=1, zorder=1)
    ax.axvline(x, color=style.FAINT, linewidth=1, zorder=1)
    ax.margins(0.12)
    style.legend_above(ax)
    _name_points(
        ax, {name: (of.sensitivity, float(np.mean(of.tuned))) for name, of in found.items()}
    )
    ax.set_xlabel("sensitivity: gain of tuning per environment over shared settings")
    ax.set_ylabel("score, tuned per environment")
    return style.tidy(ax)


def _name_points(ax: Axes, points: Mapping[str, tuple[float, float]]) -> None:
    """Name each point above it, or below it if a name above would hide another's."""
    wide, high = (end - start for start, end in (ax.get_xlim(), ax.get_ylim()))
    for name, (x, y) in points.items():
        crowded = any(
            abs(x - other_x) < _ROOM_ACROSS * wide
            and (y, name) < (other_y, other)
            and other_y - y < _ROOM_UP * high
            for other, (other_x, other_y) in points.items()
        )
        ax.annotate(
            name,
            (x, y),
            xytext=(0, -14 if crowded else 8),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            color=style.INK,
            zorder=5,
        )
