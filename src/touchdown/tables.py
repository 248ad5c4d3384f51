"""Results as tables for a terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.table import Table

from touchdown.runs.evaluation import Evaluation, is_lander
from touchdown.stats.summary import Summary

PAPER_FIGURES = (
    ("paper: DQN", "< 100"),
    ("paper: target network", "170"),
    ("paper: preferential", "199"),
    ("paper: best agent", "221"),
    ("paper: PID", "222"),
)
_OUTCOMES = ("landed", "crashed", "out of bounds", "timed out")


def evaluation_table(evaluations: Sequence[Evaluation], *, paper: bool = False) -> Table:
    """One row a pilot; with `paper`, the paper's figures below.

    Args:
        evaluations: flights from the same starts.
        paper: whether to add the paper's single-run means on its version of the lander.
    """
    first = evaluations[0]
    starts = [episode.seed for episode in first.episodes]
    lander = is_lander(first)
    table = Table(
        box=box.SIMPLE_HEAD,
        title=f"{first.env_id}: {len(starts)} greedy flights from starts {starts[0]}-{starts[-1]}",
        title_justify="left",
        pad_edge=False,
    )
    table.add_column("pilot", no_wrap=True)
    table.add_column("mean ± sd", justify="right", no_wrap=True)
    table.add_column("IQM [95% interval]", justify="right", no_wrap=True)
    table.add_column(f"≥ {first.summary.threshold:g}", justify="right", no_wrap=True)
    if lander:
        table.add_column("landed, crashed,\nout, timed out", justify="right", no_wrap=True)
    table.add_column("steps", justify="right", no_wrap=True)
    if lander:
        table.add_column("fuel", justify="right", no_wrap=True)
    table.add_column("worst 5%", justify="right", no_wrap=True)
    for evaluation in evaluations:
        table.add_row(evaluation.name, *_cells(evaluation.summary, lander=lander))
    if paper:
        table.add_section()
        for name, mean in PAPER_FIGURES:
            table.add_row(name, mean, style="dim")
        table.caption = (
            "IQM: interquartile mean; fuel: return points spent on engines; worst 5%: mean of the "
            "lowest returns.\nThe paper gives means of single runs on LunarLander-v2."
        )
        table.caption_justify = "left"
    return table


def _cells(summary: Summary, *, lander: bool) -> list[str]:
    iqm = summary.iqm
    outcomes = " ".join(f"{summary.outcomes.get(name, 0.0):4.0%}" for name in _OUTCOMES)
    cells = [
        f"{summary.mean:.1f} ± {summary.sd:.1f}",
        f"{iqm.value:.1f} [{iqm.low:.1f}, {iqm.high:.1f}]",
        f"{summary.share_solved:.0%}",
    ]
    if lander:
        cells.append(outcomes)
    cells.append(f"{summary.steps:.0f}")
    if lander:
        cells.append(f"{summary.fuel:.1f}")
    return [*cells, f"{summary.worst:.1f}"]


def runs_table(facts: Sequence[Mapping[str, Any]]) -> Table:
    """One row a run."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("run", no_wrap=True)
    for name in (
        "preset",
        "world",
        "seed",
        "status",
        "episodes",
        "observations",
        "minutes",
        "test",
    ):
        text = name in ("preset", "world", "status")
        table.add_column(name, justify="left" if text else "right", no_wrap=True)
    for run in facts:
        test = run["test"]
        table.add_row(
            run["name"],
            run["preset"],
            run["env_id"],
            str(run["seed"]),
            run["status"],
            f"{run['episodes']:,}",
            f"{run['observations']:,}",
            f"{run['seconds'] / 60:.1f}",
            f"{test['mean']:.1f} ± {test['sd']:.1f}" if test else "-",
        )
    return table
