"""Learning curves of variants over training seeds: interquartile means and their intervals."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter, PercentFormatter

from touchdown.core.types import FloatArray
from touchdown.figures import style
from touchdown.lander.rules import SOLVED_RETURN
from touchdown.stats.summary import RESAMPLES, interquartile_mean

Curve = tuple[Sequence[float], Sequence[float]]
"""Environment steps of a run's validations, in increasing order, and the mean returns."""

_COLOURS = (style.MUTED, style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.RED)
MAX_CURVES = len(_COLOURS)
"""Largest number of variants that are distinguishable in one picture."""
_POINTS = 200
LANDER_RETURNS = (-400.0, 300.0)
"""Validation returns of the lander that a picture shows."""


def iqm_and_band(curves: Sequence[Curve]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Env steps that all curves cover, their interquartile mean, and its 95% bootstrap interval.

    Args:
        curves: one per training seed; validations fall on different steps, so each curve is
            interpolated.

    Returns:
        Env steps, interquartile means, and the lower and the upper ends of the intervals. At each
        step the same seeds are drawn, so that a band is as smooth as the curves.
    """
    first, last = (edge(c[0][i] for c in curves) for edge, i in ((max, 0), (min, -1)))
    at = np.linspace(first, last, _POINTS)
    values = np.array([np.interp(at, *curve) for curve in curves])  # [seeds, points]
    drawn = np.random.default_rng(0).integers(len(curves), size=(RESAMPLES, len(curves)))
    # point by point: all at once would take gigabytes for a thousand seeds
    means = np.array([interquartile_mean(point[drawn], axis=1) for point in values.T])
    low, high = np.percentile(means, (2.5, 97.5), axis=1)
    return at, interquartile_mean(values, axis=0), low, high


def caption(curves: Mapping[str, Sequence[Curve]]) -> str:
    """The caption of `draw_rungs` and `draw_shares`: what lines and bands show.

    Args:
        curves: the curves drawn.
    """
    counts = sorted({len(runs) for runs in curves.values()})
    n = " to ".join(map(str, counts[:1] + counts[1:][-1:]))
    seeds = "training seed" if counts == [1] else "training seeds"
    band = "" if counts == [1] else "; band: its 95% bootstrap interval"
    return f"n = {n} {seeds}{' each' * (len(curves) > 1)}; line: interquartile mean{band}"


def draw_rungs(
    ax: Axes,
    curves: Mapping[str, Sequence[Curve]],
    solved: float | None = SOLVED_RETURN,
    shown: tuple[float, float] | None = LANDER_RETURNS,
) -> Axes:
    """Validation return of each variant over environment steps, with its interval shaded.

    Args:
        ax: the axes to draw on.
        curves: curves by variant name; the first is the baseline.
        solved: return that counts as solved; None draws no line for it.
        shown: lowest and highest return shown; None shows all.
    """
    _draw_curves(ax, curves)
    if solved is not None:
        ax.axhline(solved, color=style.MUTED, linewidth=1, linestyle=(0, (4, 3)), zorder=1)
    if shown is not None:
        ax.set_ylim(*shown)
    ax.set_ylabel("validation return (greedy)")
    return _over_env_steps(ax)


def draw_shares(ax: Axes, curves: Mapping[str, Sequence[Curve]], what: str) -> Axes:
    """Share of each variant over environment steps, with its interval shaded.

    Args:
        ax: the axes to draw on.
        curves: environment steps and shares from 0 to 1, by variant name.
        what: label of the axis.
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
        at, iqm, low, high = iqm_and_band(runs)
        ax.fill_between(at, low, high, color=colour, alpha=alpha, linewidth=0)
        seeds = "1 seed" if len(runs) == 1 else f"{len(runs)} seeds"
        ax.plot(at, iqm, color=colour, linewidth=1.8, label=f"{name}, {seeds}")


def _over_env_steps(ax: Axes) -> Axes:
    ax.set_xlabel("env steps")
    ax.xaxis.set_major_formatter(EngFormatter(sep=""))
    ax.set_xlim(left=0)
    style.legend_above(ax)
    return style.tidy(ax)
