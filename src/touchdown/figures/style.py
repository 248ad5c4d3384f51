"""The style of all figures, and how they are written to files."""

import functools
import warnings
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from touchdown.core import files

# Okabe and Ito's colours, distinguishable with any kind of colour vision
BLUE, ORANGE, GREEN, RED, PURPLE = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7"
INK, MUTED, FAINT = "#1d2330", "#6b7280", "#d9dce3"

_IN_ONE_LINE = 4  # entries of a legend
_DPI = 200  # twice matplotlib's, for sharp screens


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, made without pyplot, which would keep it in memory.

    Args:
        width: inches.
        height: inches.
    """
    return Figure(figsize=(width, height), dpi=_DPI, layout="constrained", facecolor="white")


def tidy(ax: Axes) -> Axes:
    """Remove decoration that carries no numbers, and put a light grid behind the data."""
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_color(FAINT)
    ax.tick_params(color=FAINT, labelcolor=MUTED, labelsize=8)
    ax.grid(visible=True, color=FAINT, linewidth=0.5, alpha=0.6)
    ax.set_axisbelow(True)
    ax.xaxis.label.set(color=MUTED, fontsize=9)
    ax.yaxis.label.set(color=MUTED, fontsize=9)
    return ax


def legend_above(ax: Axes) -> None:
    """A legend of everything labelled, above the axes, in one or two lines."""
    handles, labels = ax.get_legend_handles_labels()
    count = max(len(handles), 1)
    ax.legend(
        handles,
        labels,
        loc="lower left",
        bbox_to_anchor=(-0.01, 1.0),
        ncols=count if count <= _IN_ONE_LINE else -(-count // 2),
        frameon=False,
        fontsize=8,
        labelcolor=INK,
        columnspacing=1.4,
        handletextpad=0.5,
        borderpad=0.2,
    )


def title(figure: Figure, text: str) -> None:
    """A heading at the left edge."""
    figure.suptitle(text, x=0.012, ha="left", color=INK, fontsize=12, fontweight="bold")


def save(figure: Figure, path: Path, *others: Path) -> None:
    """Write a figure in the format of each path's suffix, completely or not at all, and clear it.

    The same figure gives the same bytes, as the file has no date and no random ids.

    Raises:
        UserError: a file cannot be written.
    """
    try:
        with (
            matplotlib.rc_context({"svg.hashsalt": "touchdown"}),
            warnings.catch_warnings(),
        ):
            # a name from anywhere may have signs that the font lacks; it draws boxes for them
            warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
            for each in (path, *others):
                metadata = {"Date": None} if each.suffix == ".svg" else None
                with files.refusing(str(each)):
                    files.write_through(each, functools.partial(figure.savefig, metadata=metadata))
    finally:
        figure.clear()
