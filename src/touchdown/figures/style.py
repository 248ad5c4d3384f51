"""The style of all figures, and how they are written to files."""

import functools
import textwrap
import warnings
from pathlib import Path
from typing import cast

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator

from touchdown.core import files
from touchdown.core.terminal import printable

# Okabe and Ito's colours, distinguishable with any kind of colour vision
BLUE, ORANGE, GREEN, RED, PURPLE = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7"
INK, MUTED, FAINT = "#1d2330", "#6b7280", "#d9dce3"

_LEGEND_WIDTH = 15  # characters per inch of a figure, at the size of a legend
_TITLE_WIDTH, _LABEL_WIDTH = 9, 13  # the same of a title, and of the names along an axis
_NAME_WIDTH = 34  # characters of a name in the list at the left of a figure
_MOST_LINES = 3
_DPI = 200  # twice matplotlib's, for sharp screens


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, made without pyplot, which would keep it in memory.

    Args:
        width: inches.
        height: inches.
    """
    return Figure(figsize=(width, height), dpi=_DPI, layout="constrained", facecolor="white")


def graded(count: int) -> list[str]:
    """Colours of ordered levels, from dark to bright.

    Args:
        count: number of levels.
    """
    from matplotlib import colormaps  # noqa: PLC0415 - only some figures need it
    from matplotlib.colors import to_hex  # noqa: PLC0415

    return [to_hex(colormaps["viridis"](0.92 * i / max(1, count - 1))) for i in range(count)]


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
    """A legend of everything labelled, above the axes, in as few lines as fit."""
    handles, labels = ax.get_legend_handles_labels()
    figure = cast(Figure, ax.get_figure(root=True))
    width = _LEGEND_WIDTH * figure.get_figwidth()
    shown = [_fitted(label, int(width) - 8, 1) for label in labels]
    # a mark and the room around it are as wide as 8 characters
    columns = int(width // (8 + max(map(len, shown), default=1)))
    rows = -(-len(shown) // max(columns, 1)) or 1
    ax.legend(
        handles,
        shown,
        loc="lower left",
        bbox_to_anchor=(-0.01, 1.0),
        ncols=max(-(-len(shown) // rows), 1),
        frameon=False,
        fontsize=8,
        labelcolor=INK,
        columnspacing=1.4,
        handletextpad=0.5,
        borderpad=0.2,
    )


def title(figure: Figure, text: str) -> None:
    """A heading at the left edge."""
    text = _fitted(text, int(_TITLE_WIDTH * figure.get_figwidth()))
    figure.suptitle(text, x=0.012, ha="left", color=INK, fontsize=12, fontweight="bold")


def save(figure: Figure, path: Path, *others: Path, follow: bool = True) -> None:
    """Write a figure in the format of each path's suffix, completely or not at all, and clear it.

    The same figure gives the same bytes, as the file has no date and no random ids. All text is
    drawn as it is: a name from anywhere may contain dollar signs or control characters, which
    would otherwise begin a formula or break an SVG.

    Args:
        figure: the figure.
        path: the file.
        others: files of the same figure.
        follow: False for a file of a run's folder, see `files.write_through`.

    Raises:
        UserError: a file cannot be written.
    """
    try:
        with (
            # the second setting is for labels of ticks, which are made when the figure is drawn
            matplotlib.rc_context({"svg.hashsalt": "touchdown", "text.parse_math": False}),
            warnings.catch_warnings(),
        ):
            # a name from anywhere may have signs that the font lacks; it draws boxes for them
            warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
            _show_text_as_it_is(figure)
            for each in (path, *others):
                metadata = {"Date": None} if each.suffix == ".svg" else None
                with files.refusing(str(each)):
                    write = functools.partial(figure.savefig, metadata=metadata)
                    files.write_through(each, write, follow=follow)
    finally:
        figure.clear()


def _show_text_as_it_is(figure: Figure) -> None:
    """Make every text printable and no part of it a formula, and wrap the names along an axis."""
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            # names along an axis, which its formatter would set again
            if isinstance(axis.get_major_locator(), FixedLocator):
                at: list[float] = axis.get_majorticklocs().tolist()
                width = _NAME_WIDTH
                if axis is ax.xaxis:
                    width = int(_LABEL_WIDTH * figure.get_figwidth() / max(len(at), 1))
                labels = axis.get_major_formatter().format_ticks(at)
                axis.set_ticks(at, [_fitted(label, width) for label in labels])
    for text in figure.findobj(Text):
        text.set_text(printable(text.get_text()))
        text.set_parse_math(False)


def _fitted(text: str, width: int, lines: int = _MOST_LINES) -> str:
    """A printable name in a few lines of a width in characters; a longer one is cut off."""
    return textwrap.fill(
        printable(text), max(width, 4), max_lines=lines, placeholder="…", break_on_hyphens=False
    )
