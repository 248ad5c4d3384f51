"""A map of verdicts: claims down, readings across."""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from matplotlib.axes import Axes

from touchdown.figures import style


class _Mark(NamedTuple):
    shape: str
    colour: str
    size: float = 46.0


_MARKS: Mapping[str, _Mark] = {
    "holds": _Mark("o", style.GREEN),
    "reached and exceeded": _Mark("^", style.GREEN),
    "no difference that matters": _Mark("s", style.BLUE, 34.0),
    "does not hold": _Mark("X", style.RED),
    "undecided": _Mark(".", style.MUTED, 26.0),
    "preview": _Mark(".", style.MUTED, 26.0),
}


_CHOSEN = _Mark("s", style.INK, 16.0)


class Column(NamedTuple):
    """A reading."""

    choices: Collection[str]
    """One of each axis."""
    verdicts: Sequence[str | None]
    """By claim; None if it has no runs."""
    is_shaded: bool = False


def draw_verdicts(
    ax: Axes, claims: Sequence[str], axes: Mapping[str, Sequence[str]], columns: Sequence[Column]
) -> Axes:
    """One mark for each claim and reading, above the choices of the reading.

    Args:
        ax: the axes to draw on.
        claims: the claims in few words, from the top.
        axes: the choices of each axis. Readings of the same choice on the first one stand together.
        columns: the readings, from the left.
    """
    places = _places(columns, next(iter(axes.values())))
    choices = [choice for of_axis in axes.values() for choice in of_axis]
    rows = _rows(len(claims), [len(of_axis) for of_axis in axes.values()])
    for place, column in zip(places, columns, strict=True):
        if column.is_shaded:
            ax.axvspan(place - 0.5, place + 0.5, color=style.FAINT, alpha=0.5, linewidth=0)
    for verdict, mark in _MARKS.items():
        points = [
            (place, row)
            for place, column in zip(places, columns, strict=True)
            for row, found in enumerate(column.verdicts)
            if found == verdict
        ]
        _draw(ax, points, mark, verdict)
    chosen = [
        (place, row)
        for place, column in zip(places, columns, strict=True)
        for row, choice in zip(rows, choices, strict=True)
        if choice in column.choices
    ]
    _draw(ax, chosen, _CHOSEN)
    ax = style.tidy(ax)
    names = [f"{axis}: {choice}" for axis, of_axis in axes.items() for choice in of_axis]
    ax.set_yticks([*range(len(claims)), *rows], [*claims, *names], color=style.INK, fontsize=8)
    ax.set_xticks([])
    ax.set_xlim(-0.6, (places[-1] if places else 0.0) + 0.6)
    ax.set_ylim(rows[-1] + 0.6, -0.6)
    ax.tick_params(length=0)
    ax.spines[["left", "bottom"]].set_visible(False)
    style.legend_above(ax)
    return ax


def _draw(
    ax: Axes, points: Sequence[tuple[float, float]], mark: _Mark, label: str | None = None
) -> None:
    xs, ys = ([point[i] for point in points] for i in (0, 1))
    ax.scatter(xs, ys, marker=mark.shape, s=mark.size, color=mark.colour, linewidths=0, label=label)


def _places(columns: Sequence[Column], first: Sequence[str]) -> list[float]:
    """Where the columns are, with room between those that differ on the first axis."""
    groups = [next(choice for choice in first if choice in each.choices) for each in columns]
    places: list[float] = []
    for number, group in enumerate(groups):
        is_next = number > 0 and group != groups[number - 1]
        places.append((places[-1] if places else -1.0) + (1.6 if is_next else 1.0))
    return places


def _rows(claims: int, counts: Sequence[int]) -> list[float]:
    """Where the choices are, below the claims, with room between axes."""
    rows: list[float] = []
    row = claims + 0.2
    for count in counts:
        rows += [row + 0.7 * number for number in range(count)]
        row = rows[-1] + 1.1
    return rows
