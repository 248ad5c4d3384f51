"""A run's learning curve: returns, validations and exploration over environment steps."""

from collections.abc import Mapping, Sequence
from math import floor, log10
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter, PercentFormatter

from touchdown.core.types import FloatArray
from touchdown.figures import style
from touchdown.lander.rules import SOLVED_RETURN

WINDOW = 100  # episodes in a moving mean, as in the paper
_SHORTEST_MEAN = 20  # episodes before the moving mean is drawn
_LOWEST_PERCENTILE = 4.0  # lower returns are marked at the edge, not to squeeze the rest

Rows = Sequence[Mapping[str, Any]]


def moving_mean(values: FloatArray, window: int = WINDOW) -> FloatArray:
    """Mean of each value and of up to `window - 1` values before it: [n] to [n]."""
    sums = np.concatenate(([0.0], np.cumsum(values)))
    ends = np.arange(1, len(values) + 1)
    starts = np.maximum(ends - window, 0)
    return (sums[ends] - sums[starts]) / (ends - starts)


def learning_curve(
    ax: Axes,
    episodes: Rows,
    validations: Rows,
    chosen_env_steps: int | None = None,
    *,
    threshold: float | None = SOLVED_RETURN,
) -> Axes:
    """Returns of training episodes and of validations over environment steps.

    Args:
        ax: the axes to draw on.
        episodes: lines of `episodes.jsonl`: `observations`, `episode_return`.
        validations: lines of `validations.jsonl`: `observations`, `mean_return`.
        chosen_env_steps: environment steps of the selected checkpoint; None marks none.
        threshold: return that counts as solved; None draws no line.
    """
    at = _column(episodes, "observations")
    returns = _column(episodes, "episode_return")
    checked_at = _column(validations, "observations")
    checked = _column(validations, "mean_return")
    low, high = _limits(returns, checked, threshold)
    if threshold is not None:
        _draw_threshold(ax, threshold)
    _draw_episodes(ax, at, returns, low)
    if len(checked):
        ax.plot(
            checked_at,
            checked,
            color=style.RED,
            linewidth=1,
            marker="o",
            markersize=3.5,
            label="validation mean (greedy)",
        )
    _mark_chosen(ax, checked_at, checked, chosen_env_steps)
    ax.set_ylim(low, high)
    ax.set_ylabel("episode return")
    style.legend_above(ax)
    return style.tidy(ax)


def exploration(ax: Axes, episodes: Rows) -> Axes:
    """ε, and the share of the last 100 episodes that timed out, over environment steps.

    Args:
        ax: the axes to draw on.
        episodes: lines of `episodes.jsonl`: `observations`, `epsilon`, `outcome`.
    """
    at = _column(episodes, "observations")
    timed_out = np.array([row["outcome"] == "timed out" for row in episodes], np.float64)
    share = moving_mean(timed_out)
    ax.fill_between(at, share, color=style.ORANGE, alpha=0.3, linewidth=0)
    ax.plot(at, _column(episodes, "epsilon"), color=style.PURPLE, linewidth=1.6, label="ε")
    label = f"share of the last {WINDOW} that timed out"
    ax.plot(at, share, color=style.ORANGE, linewidth=1.2, label=label)
    ax.set_ylim(0, 1.03)
    ax.set_yticks([0, 0.5, 1])
    ax.yaxis.set_major_formatter(PercentFormatter(1))
    ax.set_xlabel("env steps")
    style.legend_above(ax)
    return style.tidy(ax)


def save_learning_curve(
    path: Path,
    episodes: Rows,
    validations: Rows,
    chosen_env_steps: int | None,
    title: str,
    *,
    threshold: float | None = SOLVED_RETURN,
) -> None:
    """Draw a run's learning curve above its exploration, and write the figure as PNG.

    Args:
        path: the file.
        episodes: lines of `episodes.jsonl`.
        validations: lines of `validations.jsonl`.
        chosen_env_steps: environment steps of the selected checkpoint; None marks none.
        title: title above the figure.
        threshold: return that counts as solved; None draws no line.

    Raises:
        UserError: the file cannot be written.
    """
    figure = style.new_figure(8.4, 5.2)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[4.2, 1])
    learning_curve(top, episodes, validations, chosen_env_steps, threshold=threshold)
    exploration(bottom, episodes)
    bottom.xaxis.set_major_formatter(EngFormatter(sep=""))
    bottom.set_xlim(left=0)
    style.title(figure, title)
    style.save(figure, path, follow=False)


def _column(rows: Rows, name: str) -> FloatArray:
    return np.array([row[name] for row in rows], np.float64)


def _limits(
    returns: FloatArray, checked: FloatArray, threshold: float | None
) -> tuple[float, float]:
    """Axis limits that contain all but the lowest few returns of a long run."""
    solved = [] if threshold is None else [threshold]
    values = np.concatenate((returns, checked, solved))
    if not len(values):
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    if len(returns) >= WINDOW:
        typical = float(np.percentile(returns, _LOWEST_PERCENTILE))
        low = min([typical, *checked, *solved])
    spread = high - low
    margin = 0.05 * max(spread, 1.0)
    # the lower end is a round number: of 50 points, or of a tenth of the returns' magnitude
    step = 50.0 if spread >= 100 else 10.0 ** floor(log10(max(spread, 1.0))) / 10
    return step * floor((low - margin) / step), high + margin


def _draw_threshold(ax: Axes, threshold: float) -> None:
    ax.axhline(threshold, color=style.MUTED, linewidth=1, linestyle=(0, (4, 3)), zorder=1)
    ax.annotate(
        f"solved: {threshold:g}",
        (0, threshold),  # at the left, where curves are still below it
        xycoords=("axes fraction", "data"),
        xytext=(4, 3),
        textcoords="offset points",
        ha="left",
        color=style.MUTED,
        fontsize=8,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1},
    )


def _draw_episodes(ax: Axes, at: FloatArray, returns: FloatArray, low: float) -> None:
    if not len(at):
        return
    inside, below = returns >= low, np.count_nonzero(returns < low)
    ax.scatter(
        at[inside],
        returns[inside],
        s=7,
        color=style.BLUE,
        alpha=0.3,
        linewidths=0,
        label="training episode",
    )
    if below:
        label = f"{below} below {low:g}".replace("-", "−")
        ax.scatter(
            at[~inside],
            np.full(below, low),
            s=22,
            marker="v",
            color=style.BLUE,
            alpha=0.4,
            linewidths=0,
            clip_on=False,
            label=label,
        )
    # a mean of a few episodes is noisy, but a short run has no other
    first = _SHORTEST_MEAN - 1 if len(at) > 2 * _SHORTEST_MEAN else 0
    means = moving_mean(returns)
    label = f"mean of the last {WINDOW}"
    ax.plot(at[first:], means[first:], color=style.BLUE, linewidth=2, label=label)


def _mark_chosen(
    ax: Axes, checked_at: FloatArray, checked: FloatArray, chosen_env_steps: int | None
) -> None:
    if chosen_env_steps is None:
        return
    places = np.flatnonzero(checked_at == chosen_env_steps)
    if not len(places):
        return
    x, y = float(checked_at[places[0]]), float(checked[places[0]])
    ax.plot(
        [x],
        [y],
        linestyle="",
        marker="o",
        markersize=10,
        markerfacecolor="none",
        markeredgecolor=style.INK,
        markeredgewidth=1.6,
        zorder=5,
        label="selected",
    )
