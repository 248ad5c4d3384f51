"""How cost grows: with environments, with the width of the network, and with the minibatch.

    python benchmarks/growth.py --out docs/pictures/growth.png

Environments are stepped with random actions by one thread and by two. Updates are those of plain
Q-learning with a target network, on one core: JAX's, the fused ones, and the floor, which
`fused_update.py` explains. Everything of a table takes turns, once in each round.
"""

import argparse
import os
import statistics
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from fused_update import SETS, Case, measure, seconds
from touchdown.core import device
from touchdown.figures import style
from touchdown.lander._engine import simd
from touchdown.lander.vector import LanderVectorEnv
from touchdown.runs.provenance import cpu_name

ENVIRONMENTS = (1, 4, 16, 64, 256, 1_024, 4_096, 16_384, 65_536)
WIDTHS = (16, 32, 64, 128, 256, 512)
BATCHES = (16, 32, 64, 128, 256, 512, 1_024)
LANDER_STEPS = 262_144  # in each round, at least

Medians = list[tuple[float, ...]]
"""For each size, the median of each side."""


def steps_with(num_envs: int, num_threads: int) -> Callable[[], float]:
    """A function that measures microseconds for a step of one lander."""
    env = LanderVectorEnv(num_envs, num_threads=num_threads)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    count = max(20, LANDER_STEPS // num_envs)
    actions = rng.integers(4, size=(min(count, 100), num_envs))

    def fly() -> None:
        for step in range(count):
            env.step(actions[step % len(actions)])

    return lambda: 1e6 * seconds(fly) / (count * num_envs)


def engine(rounds: int) -> Medians:
    """Microseconds for a step of one lander, with one thread and with two."""
    found: Medians = []
    for num_envs in ENVIRONMENTS:
        sides = [steps_with(num_envs, threads) for threads in (1, 2)]
        for side in sides:
            side()  # past the start, when all landers fly and the threads are tried out
        times = [[side() for side in sides] for _ in range(rounds)]
        found.append(tuple(map(statistics.median, zip(*times, strict=True))))
    return found


def updates(cases: Sequence[Case], args: argparse.Namespace) -> Medians:
    """Microseconds of an update by JAX, by the fused kernel, and of the floor."""
    found: Medians = []
    for case in cases:
        rounds = measure(case, args)
        found.append(tuple(map(statistics.median, zip(*rounds, strict=True))))
    return found


def table(heads: Sequence[str], sizes: Sequence[int], rows: Medians, digits: int) -> None:
    """Print one table of Markdown."""
    print("| " + " | ".join(heads) + " |")
    print("|" + " ---: |" * len(heads))
    for size, row in zip(sizes, rows, strict=True):
        print(f"| {size:,} | " + " | ".join(f"{value:,.{digits}f}" for value in row) + " |")
    print(flush=True)


def draw(ax: Axes, sizes: Sequence[int], rows: Medians, names: Sequence[str], what: str) -> None:
    """Draw the sides of one table over its sizes, both on logarithmic axes."""
    colours = (style.ORANGE, style.BLUE, style.MUTED)
    for name, values, colour in zip(names, zip(*rows, strict=True), colours, strict=False):
        ax.plot(sizes, values, color=colour, marker="o", markersize=3.5, linewidth=1.6, label=name)
    ax.set_xscale("log", base=2)
    ax.set_yscale("log")
    ax.set_xticks(
        sizes[::2], [f"{size // 1024}k" if size >= 1024 else f"{size}" for size in sizes[::2]]
    )
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.minorticks_off()
    ax.set_xlabel(what)
    ax.legend(frameon=False, fontsize=8, labelcolor=style.INK)
    style.tidy(ax)


def main() -> None:
    """Measure, print the tables and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--updates", type=int, default=100)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    if simd() in SETS and "OPENBLAS_CORETYPE" not in os.environ:
        # NumPy reads this on import: its products are to use the instruction set that we use
        os.environ["OPENBLAS_CORETYPE"] = SETS[simd()]
        os.execv(sys.executable, [sys.executable, *sys.argv])  # noqa: S606
    print(f"{cpu_name()}, {simd()}; medians of {args.rounds} rounds\n")
    flown = engine(args.rounds)
    per_second = [tuple(1e6 / value for value in row) for row in flown]
    table(("environments", "1 thread, steps/s", "2 threads, steps/s"), ENVIRONMENTS, per_second, 0)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    device.start()
    sides = ("JAX", "fused", "floor")
    heads = [f"{side}, µs" for side in sides]
    by_width = updates([Case((width, width), 64) for width in WIDTHS], args)
    table(("width", *heads), WIDTHS, by_width, 1)
    by_batch = updates([Case((100, 100, 100), size) for size in BATCHES], args)
    table(("minibatch", *heads), BATCHES, by_batch, 1)
    if args.out is None:
        return
    figure = style.new_figure(9.6, 3.6)
    axes = figure.subplots(1, 3)
    draw(axes[0], ENVIRONMENTS, flown, ("1 thread", "2 threads"), "environments")
    draw(axes[1], WIDTHS, by_width, sides, "width of both layers")
    draw(axes[2], BATCHES, by_batch, sides, "minibatch")
    axes[0].set_ylabel("µs for a step of one lander")
    axes[1].set_ylabel("µs for an update (minibatches of 64)")
    axes[2].set_ylabel("µs for an update ([100, 100, 100])")
    style.title(figure, "How cost grows")
    style.save(figure, args.out)


if __name__ == "__main__":
    main()
