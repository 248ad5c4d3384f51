"""Learning curves of variants over training seeds, with the interval of their mean."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter, PercentFormatter
from scipy import stats

from touchdown.core.types import FloatArray
from touchdown.figures import style
from touchdown.lander.rules import SOLVED_RETURN

Curve = tuple[Sequence[float], Sequence[float]]
"""Environment steps at which a run was validated, rising, and the mean returns."""

_COLOURS = (style.MUTED, style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.RED)
MAX_CURVES = len(_COLOURS)
"""Variants that one picture can tell apart."""
_POINTS = 200
LANDER_RETURNS = (-400.0, 300.0)
"""Validation returns of the lander that a picture shows."""


def mean_and_interval(curves: Sequence[Curve]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Env steps that all curves cover, their mean, and half its 95% interval by Student's t.

    Args:
        curves: one per training seed; validations fall on different steps, so each curve is
            interpolated.
    """
    first, last = (edge(c[0][i] for c in curves) for edge, i in ((max, 0), (min, -1)))
    at = np.linspace(first, last, _POINTS)
    values = np.array([np.interp(at, *curve) for curve in curves])
    if len(curves) < 2:
        return at, values[0], np.zeros(_POINTS)
    width = float(stats.t.ppf(0.975, len(curves) - 1)) / len(curves) ** 0.5
    return at, values.mean(axis=0), width * values.std(axis=0, ddof=1)


def draw_rungs(
    ax: Axes,
    curves: Mapping[str, Sequence[Curve]],
    solved: float | None = SOLVED_RETURN,
    shown: tuple[float, float] | None = LANDER_RETURNS,
) -> Axes:
    """Mean validation return of each variant over environment steps, with its interval shaded.

    Args:
        ax: to draw on.
        curves: by the variant's name; the first is the one to compare with.
        solved: return that counts as solved; None draws no line for it.
        shown: lowest and highest return shown; None shows all.
    """
    _draw_curves(ax, curves)
    if solved is not None:
        ax.axhline(solved, color=style.MUTED, linewidth=1, linestyle=(0, (4, 3)), zorder=1)
    if shown is not None:
        ax.set_ylim(*shown)
    ax.set_ylabel("validation return, greedy")
    return _over_env_steps(ax)


def draw_shares(ax: Axes, curves: Mapping[str, Sequence[Curve]], what: str) -> Axes:
    """Mean share of each variant over environment steps, with its interval shaded.

    Args:
        ax: to draw on.
        curves: by the variant's name: environment steps, and shares from 0 to 1.
        what: label of the axis: what the shares are of.
    """
    _draw_curves(ax, curves)
    ax.set_ylim(0, 1.02)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_ylabel(what)
    return _over_env_steps(ax)


def _draw_curves(ax: Axes, curves: Mapping[str, Sequence[Curve]]) -> None:
    # the more bands overlap, the fainter each must be
    alpha = min(0.15, 0.36 / len(curves))
    for (name, runs), colour in zip(curves.items(), _COLOURS, strict=False):
        at, mean, half = mean_and_interval(runs)
        ax.fill_between(at, mean - half, mean + half, color=colour, alpha=alpha, linewidth=0)
        seeds = "1 seed" if len(runs) == 1 else f"{len(runs)} seeds"
        ax.plot(at, mean, color=colour, linewidth=1.8, label=f"{name}, {seeds}")


def _over_env_steps(ax: Axes) -> Axes:
    ax.set_xlabel("env steps")
    ax.xaxis.set_major_formatter(EngFormatter(sep=""))
    ax.set_xlim(left=0)
    style.legend_above(ax)
    return style.tidy(ax)
