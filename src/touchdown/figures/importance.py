"""The importance of each setting in a search."""

from collections.abc import Mapping
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter

from touchdown.figures import style


def draw_importance(ax: Axes, importance: Mapping[str, float]) -> Axes:
    """One bar per setting, the largest at the top.

    Args:
        ax: the axes to draw on.
        importance: share of each setting, by its name.
    """
    ranked = sorted(importance.items(), key=lambda item: item[1])
    bars = ax.barh([name for name, _ in ranked], [share for _, share in ranked], color=style.BLUE)
    ax.bar_label(bars, fmt="{:.0%}", padding=4, color=style.INK, fontsize=8)
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_xlabel("relative importance (PED-ANOVA)")
    ax = style.tidy(ax)
    ax.tick_params(axis="y", labelcolor=style.INK, length=0)
    ax.grid(visible=False, axis="y")
    ax.margins(x=0.12)
    return ax


def save_importance(path: Path, importance: Mapping[str, float]) -> None:
    """Draw the importance of the settings and write it as PNG.

    Raises:
        UserError: the file cannot be written.
    """
    figure = style.new_figure(6.4, 0.9 + 0.35 * len(importance))
    draw_importance(figure.subplots(), importance)
    style.save(figure, path)
