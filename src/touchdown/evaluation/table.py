"""Evaluations as a table for a terminal, and as rows for a model card."""

from collections.abc import Sequence

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from touchdown.evaluation.evaluation import Evaluation, is_lander
from touchdown.evaluation.rows import summary_rows

PAPER_MEANS = {
    "DQN": "< 100",
    "target network": "170",
    "preferential": "199",
    "best agent": "221",
    "PID": "222",
}
"""Mean test returns that the paper reports, each of a single run on LunarLander-v2."""


def evaluation_table(
    evaluations: Sequence[Evaluation], *, paper: bool = False, note: str = ""
) -> Group:
    """A table with one column per policy, narrow enough for four of them in 80 characters.

    Args:
        evaluations: evaluations from the same starts; with `paper`, the agent's first and `pid`'s
            second.
        paper: whether to add the paper's means, with the PID's in the column of `pid`.
        note: a sentence that begins the notes under the table.
    """
    first = evaluations[0]
    starts = [episode.seed for episode in first.episodes]
    title = f"{first.env_id}: {len(starts)} greedy episodes from starts {starts[0]}-{starts[-1]}"
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("", no_wrap=True)
    for evaluation in evaluations:
        table.add_column(evaluation.name, justify="right")
    summaries = [evaluation.summary for evaluation in evaluations]
    for name, cell in summary_rows(first.env_id, first.summary.threshold):
        table.add_row(name, *map(cell, summaries))
    if paper:
        table.add_section()
        for name, mean in PAPER_MEANS.items():
            cells = ["", mean] if name == "PID" else [mean]
            table.add_row(f"paper: {name}", *cells, style="dim")
    notes = (
        f"{note} IQM: interquartile mean, with its 95% bootstrap interval. "
        "Worst 5%: mean of the lowest returns."
    ).strip()
    if is_lander(first):
        notes += " Fuel: return points spent on engines."
    if paper:
        notes += " The paper: means of single runs on LunarLander-v2."
    return Group(Text(title, style="bold"), table, Text(notes, style="dim"))


def evaluation_rows(evaluation: Evaluation) -> list[tuple[str, str]]:
    """The rows of the table for one policy: names and cells, in order."""
    summary = evaluation.summary
    rows = summary_rows(evaluation.env_id, summary.threshold)
    return [(name.strip(), cell(summary)) for name, cell in rows]
