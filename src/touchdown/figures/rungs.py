"""Learning curves of variants over training seeds: interquartile means and their intervals."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
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
PANELS_IN_A_ROW = 3
_VALIDATION = "validation return (greedy)"
_SHARES = (0.0, 1.02)
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
    draw_numbers(ax, curves, _VALIDATION, shown)
    _mark_solved(ax, solved)
    return ax


def draw_shares(ax: Axes, curves: Mapping[str, Sequence[Curve]], what: str) -> Axes:
    """Share of each variant over environment steps, with its interval shaded.

    Args:
        ax: the axes to draw on.
        curves: environment steps and shares from 0 to 1, by variant name.
        what: label of the axis.
    """
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    return draw_numbers(ax, curves, what, _SHARES)


def draw_numbers(
    ax: Axes,
    curves: Mapping[str, Sequence[Curve]],
    what: str,
    shown: tuple[float, float] | None = None,
) -> Axes:
    """Numbers of each variant over environment steps, with their interval shaded.

    Args:
        ax: the axes to draw on.
        curves: environment steps and numbers, by variant name.
        what: label of the axis.
        shown: lowest and highest number shown; None shows all.
    """
    _draw_curves(ax, curves)
    if shown is not None:
        ax.set_ylim(*shown)
    ax.set_ylabel(what)
    return _over_env_steps(ax)


def draw_panels(
    figure: Figure,
    curves: Mapping[str, Sequence[Curve]],
    base: str,
    solved: float | None = SOLVED_RETURN,
    shown: tuple[float, float] | None = LANDER_RETURNS,
) -> None:
    """Validation return over environment steps: a panel for each level, with the base in grey.

    Args:
        figure: an empty figure.
        curves: curves by the level's name.
        base: name of the level that each is compared with.
        solved: return that counts as solved; None draws no line for it.
        shown: lowest and highest return shown; None shows all.
    """
    rows = -(-len(curves) // PANELS_IN_A_ROW)
    panels = figure.subplots(rows, PANELS_IN_A_ROW, sharex=True, sharey=True, squeeze=False).flat
    # the curves first, so that no panel is lost when they end
    for (name, runs), ax in zip(curves.items(), panels, strict=False):
        if base in curves and name != base:
            _draw_curve(ax, curves[base], style.MUTED, "", 0.12)
        _draw_curve(ax, runs, style.ORANGE if name == base else style.BLUE, "", 0.2)
        _mark_solved(ax, solved)
        if shown is not None:
            ax.set_ylim(*shown)
        ax.set_title(f"{name}{' (base)' * (name == base)}", fontsize=9, loc="left")
        ax.xaxis.set_major_formatter(EngFormatter(sep=""))
        ax.set_xlim(left=0)
        style.tidy(ax)
    for ax in panels:  # the rest of the last row
        ax.set_axis_off()
    figure.supxlabel("env steps", fontsize=9, color=style.MUTED)
    figure.supylabel(_VALIDATION, fontsize=9, color=style.MUTED)


def draw_reached(ax: Axes, times: Mapping[str, FloatArray], end: float, what: str) -> Axes:
    """The share of each level's seeds that have reached something, over environment steps.

    It is 1 minus the estimate of Kaplan & Meier (1958), for seeds that are censored at the end of
    training alone.

    Args:
        ax: the axes to draw on.
        times: environment steps until a seed reached it, ∞ if it never did, by the level's name.
        end: environment steps of training.
        what: what they reach.
    """
    colours = _COLOURS if len(times) <= MAX_CURVES else style.graded(len(times))
    for (name, of), colour in zip(times.items(), colours, strict=False):
        known = np.sort(of[np.isfinite(of)])
        at = np.concatenate(([0.0], known, [end]))
        shares = np.concatenate((np.arange(len(known) + 1), [len(known)])) / len(of)
        label = f"{name}: {len(known)} of {len(of)}"
        ax.step(at, shares, where="post", color=colour, linewidth=1.8, label=label)
    ax.set_ylim(*_SHARES)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_ylabel(what)
    return _over_env_steps(ax)


def _mark_solved(ax: Axes, solved: float | None) -> None:
    """A line at the return that counts as solved, if there is one."""
    if solved is not None:
        ax.axhline(solved, color=style.MUTED, linewidth=1, linestyle=(0, (4, 3)), zorder=1)


def _draw_curves(ax: Axes, curves: Mapping[str, Sequence[Curve]]) -> None:
    # the more bands overlap, the fainter each must be
    alpha = min(0.15, 0.36 / len(curves))
    for (name, runs), colour in zip(curves.items(), _COLOURS, strict=False):
        seeds = "1 seed" if len(runs) == 1 else f"{len(runs)} seeds"
        _draw_curve(ax, runs, colour, f"{name}, {seeds}", alpha)


def _draw_curve(ax: Axes, runs: Sequence[Curve], colour: str, label: str, alpha: float) -> None:
    at, iqm, low, high = iqm_and_band(runs)
    ax.fill_between(at, low, high, color=colour, alpha=alpha, linewidth=0)
    ax.plot(at, iqm, color=colour, linewidth=1.8, label=label or None)


def _over_env_steps(ax: Axes) -> Axes:
    ax.set_xlabel("env steps")
    ax.xaxis.set_major_formatter(EngFormatter(sep=""))
    ax.set_xlim(left=0)
    style.legend_above(ax)
    return style.tidy(ax)
