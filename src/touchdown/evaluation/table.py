"""An evaluation as a table for a terminal, and its rows for a model card."""

from collections.abc import Callable, Iterator, Sequence

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from touchdown.evaluation.evaluation import Evaluation, is_lander
from touchdown.stats.summary import Summary

PAPER_MEANS = {
    "DQN": "< 100",
    "target network": "170",
    "preferential": "199",
    "best agent": "221",
    "PID": "222",
}
"""What the paper reports, each from a single run on LunarLander-v2."""


def evaluation_table(
    evaluations: Sequence[Evaluation], *, paper: bool = False, note: str = ""
) -> Group:
    """One column a policy, so that four of them fit a terminal of 80 characters.

    Args:
        evaluations: flights from the same starts; with `paper`, an agent's first and `pid` second.
        paper: whether to add the paper's means, the PID's under the PID.
        note: a sentence to stand under the table, before the others.
    """
    first = evaluations[0]
    starts = [episode.seed for episode in first.episodes]
    title = f"{first.env_id}: {len(starts)} greedy flights from starts {starts[0]}-{starts[-1]}"
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("", no_wrap=True)
    for evaluation in evaluations:
        table.add_column(evaluation.name, justify="right")
    summaries = [evaluation.summary for evaluation in evaluations]
    for name, cell in _rows(first):
        table.add_row(name, *map(cell, summaries))
    if paper:
        table.add_section()
        for name, mean in PAPER_MEANS.items():
            cells = ["", mean] if name == "PID" else [mean]
            table.add_row(f"paper: {name}", *cells, style="dim")
    notes = (
        f"{note} IQM: interquartile mean, with its 95% bootstrap interval. "
        "Worst 5%: mean of the lowest."
    ).strip()
    if is_lander(first):
        notes += " Fuel: return points spent on engines."
    if paper:
        notes += " The paper: means of single runs on LunarLander-v2."
    return Group(Text(title, style="bold"), table, Text(notes, style="dim"))


def evaluation_rows(evaluation: Evaluation) -> list[tuple[str, str]]:
    """What the table says of one policy: each row's name and cell, in its order."""
    return [(name.strip(), cell(evaluation.summary)) for name, cell in _rows(evaluation)]


def _points(value: float, decimals: int) -> str:
    """Return points; of worlds that pay 1 in all, the hundredths are what there is to see."""
    return f"{value:.{2 if abs(value) < 2 else decimals}f}"


def _rows(first: Evaluation) -> Iterator[tuple[str, Callable[[Summary], str]]]:
    """What the rows are called and how each cell is made."""
    yield "return, mean ± sd", lambda s: f"{_points(s.mean, 1)} ± {_points(s.sd, 0)}"
    yield "return, IQM", lambda s: _points(s.iqm.value, 1)
    yield "  95% interval", lambda s: f"[{_points(s.iqm.low, 0)}, {_points(s.iqm.high, 0)}]"
    yield "return, worst 5%", lambda s: _points(s.worst, 1)
    if first.summary.threshold is not None:
        yield f"share ≥ {first.summary.threshold:g}", lambda s: f"{s.share_solved:.0%}"
    if is_lander(first):
        for outcome in ("landed", "crashed", "out of bounds", "timed out"):
            yield outcome, lambda s, outcome=outcome: f"{s.outcomes.get(outcome, 0.0):.0%}"
    yield "steps", lambda s: f"{s.steps:.0f}"
    if is_lander(first):
        yield "fuel", lambda s: f"{s.fuel:.1f}"
