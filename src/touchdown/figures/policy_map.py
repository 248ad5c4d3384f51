"""Greedy policies of gridworlds as maps of arrows, drawn and in text."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, QuadMesh
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from touchdown.core.types import FloatArray
from touchdown.figures import style
from touchdown.figures.grid import Cell, GridWorld

UNDECIDED = "·"
"""Shown where all actions have the same value, as in a state that was never visited."""

# colours of cells without an action, by their letter; "" is a cell of a map without actions
_TINTS = {"H": style.MUTED, "C": style.MUTED, "G": style.GREEN, "": "#f5f6f8"}
_VALUES = LinearSegmentedColormap.from_list("values", ["#f3f8fb", "#c4ddec", "#5aa5cf"])
_FONT = FontProperties(family="DejaVu Sans", weight="bold")  # comes with matplotlib, has arrows
# height of an em, as a share of the side of a cell
_ACTION_SIZE, _MARK_SIZE, _CORNER_SIZE = 0.62, 0.48, 0.24
_OUTSIDE = " "  # between maps in a sheet
_GAP = "   "  # between maps in text


def greedy_glyphs(grid: GridWorld, q: FloatArray) -> NDArray[np.str_]:
    """The character in each cell: the glyph of the best action, or the mark of a cell without one.

    In a tie the first best action is shown, as by argmax, unless all are equal.

    Args:
        grid: the layout of the cells.
        q: Q(s,a): [S, A].

    Returns:
        Single characters: [M, R, C].

    Raises:
        ValueError: the table does not have the states and actions of the grid.
    """
    wanted = (grid.states.size, len(grid.glyphs))
    if q.shape != wanted:
        raise ValueError(f"q must be {list(wanted)} for this grid, got {list(q.shape)}")
    best = np.array(list(grid.glyphs))[q.argmax(axis=1)]  # [S]
    best[q.max(axis=1) == q.min(axis=1)] = UNDECIDED
    return np.where(grid.acts, best[grid.states], grid.letters)


def policy_text(grid: GridWorld, q: FloatArray) -> str:
    """A greedy policy as lines of arrows; walls are bars, cells without actions are blank.

    Args:
        grid: the layout of the cells.
        q: Q(s,a): [S, A].

    Raises:
        ValueError: the table does not have the states and actions of the grid.
    """
    glyphs = greedy_glyphs(grid, q)
    across = len(grid.column_names)
    width = 2 * glyphs.shape[2] - 1
    maps = [_lines(one, _walls(grid, number)) for number, one in enumerate(glyphs)]
    lines: list[str] = []
    for number, name in enumerate(grid.row_names):
        if name:
            names = (f"{column:<{width}}" for column in grid.column_names)
            lines += [*([""] if lines else []), name, _GAP.join(names)]
        side_by_side = maps[number * across : (number + 1) * across]
        lines += [_GAP.join(line) for line in zip(*side_by_side, strict=True)]
    return "\n".join(line.rstrip() for line in lines)


def draw_policy(ax: Axes, grid: GridWorld, q: FloatArray) -> Axes:
    """A greedy policy as arrows over the cells, coloured by the value of the best action.

    Args:
        ax: the axes to draw on.
        grid: the layout of the cells.
        q: Q(s,a): [S, A].

    Raises:
        ValueError: the table does not have the states and actions of the grid.
    """
    across = len(grid.column_names)
    values = q.max(axis=1)[grid.states]
    glyphs = _sheet(greedy_glyphs(grid, q), across, "")
    acts = _sheet(grid.acts, across, fill=False)
    letters = _sheet(grid.letters, across, _OUTSIDE)
    height, width = acts.shape
    mesh = _draw_cells(
        ax, _sheet(values, across, 0.0), acts, cmap=_VALUES, norm=_norm(values[grid.acts])
    )
    for letter, tint in _TINTS.items():
        _draw_cells(ax, np.ones(acts.shape), ~acts & (letters == letter), cmap=_plain(tint))
    marks = np.where(letters == _OUTSIDE, "", letters)
    _draw_glyphs(ax, np.where(acts, "", marks), _MARK_SIZE, "white", gid="marks")
    _draw_glyphs(ax, np.where(acts, marks, ""), _CORNER_SIZE, style.MUTED, corner=0.35)
    _draw_glyphs(ax, np.where(acts, glyphs, ""), _ACTION_SIZE, style.INK, gid="actions")
    _draw_frames(ax, grid)
    ax.set(xlim=(-0.05, width + 0.05), ylim=(height + 0.05, -0.05), aspect="equal")
    ax.set_axis_off()
    _draw_colour_bar(ax, mesh, acts.shape)
    return ax


def save_policy(path: FilePath, grid: GridWorld, q: FloatArray, title: str) -> None:
    """Draw a policy as a map and write it as PNG.

    Args:
        path: the file.
        grid: the layout of the cells.
        q: Q(s,a): [S, A].
        title: title above the map.

    Raises:
        UserError: the file cannot be written.
    """
    _, rows, columns = grid.states.shape
    across, down = columns * len(grid.column_names), rows * len(grid.row_names)
    cell = 0.62 if len(grid.states) == 1 else 0.3  # inches
    # no more than the colour bar and the title need, or a band would stay empty
    figure = style.new_figure(cell * across + 1.0, cell * down + 0.55)
    draw_policy(figure.subplots(), grid, q)
    style.title(figure, title)
    style.save(figure, path, follow=False)


def draw_path(ax: Axes, cells: Sequence[Cell], colour: str, label: str) -> Axes:
    """A path through the centres of a map's cells, below the arrows, with a legend above.

    Args:
        ax: axes with the map.
        cells: cells in the order of the path; a jump, as from the cliff to the start, leaves a gap.
        colour: colour of the line.
        label: label in the legend.
    """
    path = np.array(cells, np.float64).reshape(-1, 2) + 0.5
    jumps = np.flatnonzero(np.abs(np.diff(path, axis=0)).sum(axis=1) > 1.5) + 1
    y, x = np.insert(path, jumps, np.nan, axis=0).T
    ax.plot(
        x,
        y,
        color=colour,
        alpha=0.75,
        linewidth=6,
        solid_joinstyle="round",
        solid_capstyle="round",
        label=label,
        zorder=1.5,
    )
    style.legend_above(ax)
    return ax


def _walls(grid: GridWorld, number: int) -> tuple[Cell, ...]:
    """The walls of one map; a map without actions has none."""
    return grid.walls if grid.acts[number].any() else ()


def _lines(glyphs: NDArray[np.str_], walls: tuple[Cell, ...]) -> list[str]:
    """One map in text."""
    return [
        "".join(
            (glyph or " ") + ("|" if (row, column) in walls else " ")
            for column, glyph in enumerate(line)
        )[:-1]
        for row, line in enumerate(glyphs)
    ]


def _sheet(maps: NDArray[Any], across: int, fill: Any) -> NDArray[Any]:
    """Maps laid out `across` per row, one cell apart: [M, R, C] to one sheet."""
    padded = np.pad(maps, ((0, 0), (0, 1), (0, 1)), constant_values=fill)
    _, rows, columns = padded.shape
    laid = padded.reshape(-1, across, rows, columns).swapaxes(1, 2)
    return laid.reshape(-1, across * columns)[:-1, :-1]


def _norm(values: FloatArray) -> Normalize:
    """The smallest to the largest value of all maps, so that colours are comparable."""
    low, high = float(values.min()), float(values.max())
    return Normalize(low, high) if low < high else Normalize(low - 0.5, low + 0.5)


def _plain(colour: str) -> LinearSegmentedColormap:
    """A colour map with a single colour."""
    return LinearSegmentedColormap.from_list(colour, [colour, colour])


def _draw_cells(ax: Axes, values: FloatArray, where: NDArray[np.bool_], **colours: Any) -> QuadMesh:
    """Some of the cells, with thin lines between them."""
    shown = np.ma.masked_where(~where, values)
    return ax.pcolormesh(shown, edgecolor="white", linewidth=0.8, **colours)


def _draw_colour_bar(ax: Axes, mesh: QuadMesh, shape: tuple[int, ...]) -> None:
    """A colour bar, right of the map."""
    # its name is above it, because the layout would cut it off at the side
    height, width = shape
    bar = ax.inset_axes((1 + 0.3 / width, 0.0, 0.015 + 0.08 / width, 1 - 0.5 / height))
    ax.figure.colorbar(mesh, cax=bar)
    bar.set_title("max Q", loc="left", color=style.MUTED, fontsize=8)
    bar.tick_params(length=0, labelcolor=style.MUTED, labelsize=8)
    for spine in bar.spines.values():
        spine.set_visible(False)


def _draw_glyphs(
    ax: Axes,
    glyphs: NDArray[np.str_],
    size: float,
    colour: str,
    *,
    corner: float = 0.0,
    gid: str | None = None,
) -> None:
    """Characters at the centres of their cells, or towards the upper left, scaled with the map."""
    paths = [
        _glyph(str(glyphs[row, column])).transformed(
            Affine2D().scale(size, -size).translate(column + 0.5 - corner, row + 0.5 - corner)
        )
        for row, column in np.argwhere(glyphs != "")
    ]
    drawn = PathCollection(paths, facecolor=colour, linewidth=0, zorder=2, gid=gid)
    ax.add_collection(drawn, autolim=False)


@lru_cache
def _glyph(character: str) -> Path:
    """The outline of a character, centred at the origin, with an em of 1."""
    path = TextPath((0, 0), character, size=1, prop=_FONT)
    box = path.get_extents()
    return path.transformed(Affine2D().translate(-(box.x0 + box.x1) / 2, -(box.y0 + box.y1) / 2))


def _draw_frames(ax: Axes, grid: GridWorld) -> None:
    """The names of the rows and columns of maps, and the walls in each map."""
    _, rows, columns = grid.states.shape
    lefts = [number * (columns + 1) for number in range(len(grid.column_names))]
    tops = [number * (rows + 1) for number in range(len(grid.row_names))]
    text: dict[str, Any] = {"color": style.MUTED, "fontsize": 8, "ha": "center"}
    for left, name in zip(lefts, grid.column_names, strict=True):
        ax.text(left + columns / 2, -0.35, name, va="bottom", **text)
    for top, name in zip(tops, grid.row_names, strict=True):
        ax.text(-0.45, top + rows / 2, name, va="center", rotation=90, **text)
    corners = [(left, top) for top in tops for left in lefts]
    segments = [
        [(left + column + 1, top + row), (left + column + 1, top + row + 1)]
        for number, (left, top) in enumerate(corners)
        for row, column in _walls(grid, number)
    ]
    ax.add_collection(LineCollection(segments, color=style.INK, linewidth=1.6, zorder=3))
