"""Flight paths of policies from the same starts, over the ground."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from touchdown.core.types import Outcome
from touchdown.envs.flight import Flight, Terrain
from touchdown.figures import style
from touchdown.render.canvas import WIDTH

_POLICY_COLOURS = (style.BLUE, style.RED, style.GREEN, style.PURPLE, style.ORANGE)
_OUTCOME_MARKERS: dict[Outcome, str] = {
    "landed": "o",
    "crashed": "X",
    "out of bounds": ">",
    "timed out": "s",
}
_GROUND, _GROUND_OPACITY = "#8b93a3", 0.4


def flights_overlay(ax: Axes, groups: Mapping[str, Sequence[Flight]]) -> Axes:
    """Paths of the lander's hull, one colour per policy, with the outcome of each flight.

    Args:
        ax: the axes to draw on.
        groups: flights of the lander by policy name, from the same starts.

    Raises:
        ValueError: a flight is not the lander's.
    """
    flights = [flight for group in groups.values() for flight in group]
    _draw_ground(ax, {flight.seed: _terrain(flight) for flight in flights})
    for (name, group), colour in zip(groups.items(), cycle(_POLICY_COLOURS), strict=False):
        for flight in group:
            _draw_path(ax, flight, colour)
        landed = sum(flight.outcome == "landed" for flight in group)
        ax.plot([], [], color=colour, linewidth=2, label=f"{name}: {landed} of {len(group)} landed")
    seen = {flight.outcome for flight in flights}
    start = Line2D(
        [], [], color=style.INK, linestyle="", marker="o", markersize=5, mfc="white", label="start"
    )
    ends = [
        Line2D([], [], color=style.MUTED, linestyle="", marker=marker, markersize=6, label=outcome)
        for outcome, marker in _OUTCOME_MARKERS.items()
        if outcome in seen
    ]
    marks = ax.legend(
        handles=[start, *ends],
        loc="upper right",
        frameon=False,
        fontsize=8,
        labelcolor=style.INK,
        handletextpad=0.3,
    )
    style.legend_above(ax)
    ax.add_artist(marks)  # the second legend replaced it
    ax.set_aspect("equal")
    ax.set_xlim(0, WIDTH)
    ax.set_ylim(bottom=0)
    ax.xaxis.set_major_locator(MultipleLocator(5))
    ax.yaxis.set_major_locator(MultipleLocator(5))
    ax.set_xlabel("x in metres")
    ax.set_ylabel("height in metres")
    return style.tidy(ax)


def save_flights(path: Path, groups: Mapping[str, Sequence[Flight]], title: str) -> None:
    """Draw flights of several policies over each other and write them as PNG.

    Args:
        path: the file.
        groups: flights of the lander by policy name, from the same starts.
        title: title above the figure.

    Raises:
        UserError: the file cannot be written.
    """
    figure = style.new_figure(8.4, 6.4)
    flights_overlay(figure.subplots(), groups)
    style.title(figure, title)
    style.save(figure, path, follow=False)


def _terrain(flight: Flight) -> Terrain:
    if flight.terrain is None:
        raise ValueError(f"{flight.env_id}: only the lander's flights have a path over the ground")
    return flight.terrain


def _draw_ground(ax: Axes, terrains: Mapping[int, Terrain]) -> None:
    """The ground of every start; darkest where all starts have ground."""
    for terrain in terrains.values():
        opacity = 1 - (1 - _GROUND_OPACITY) ** (1 / len(terrains))
        ax.fill_between(
            terrain.xs, terrain.heights, color=_GROUND, alpha=opacity, linewidth=0, zorder=0.5
        )
        ax.plot(terrain.xs, terrain.heights, color=_GROUND, linewidth=0.8, alpha=0.6, zorder=0.6)
        # the pad is in the same place at every start
        ax.plot(
            [terrain.helipad_x1, terrain.helipad_x2],
            [terrain.helipad_y, terrain.helipad_y],
            color=style.INK,
            linewidth=3,
            solid_capstyle="butt",
            zorder=1.5,
        )


def _draw_path(ax: Axes, flight: Flight, colour: str) -> None:
    if flight.bodies is None:
        raise ValueError(f"{flight.env_id}: only the lander's flights have a path over the ground")
    xs, ys = flight.bodies[:, 0, 0], flight.bodies[:, 0, 1]
    ax.plot(xs, ys, color=colour, linewidth=1.4, alpha=0.75, zorder=2)
    ax.plot(
        xs[:1],
        ys[:1],
        linestyle="",
        marker="o",
        markersize=5,
        markerfacecolor="white",
        markeredgecolor=style.INK,
        markeredgewidth=1,
        zorder=3,
    )
    ax.plot(
        xs[-1:],
        ys[-1:],
        color=colour,
        linestyle="",
        marker=_OUTCOME_MARKERS[flight.outcome],
        markersize=7,
        markeredgecolor="white",
        markeredgewidth=0.8,
        zorder=3,
        clip_on=False,
    )
