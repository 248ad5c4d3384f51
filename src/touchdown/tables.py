"""Results as tables for a terminal."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from touchdown.doctor import Finding
from touchdown.runs.evaluation import Evaluation, is_lander
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
    """One column a pilot, so that four of them fit a terminal of 80 characters.

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
    """What the table says of one pilot: each row's name and cell, in its order."""
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
        if run["status"] == "broken":
            table.add_row(Text(run["name"]), "", "", "", Text("broken", style="bold red"))
            continue
        test = run["test"]
        table.add_row(
            Text(run["name"]),
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


def findings_table(findings: Sequence[Finding]) -> Table:
    """One row a thing that the doctor looked at."""
    marks = {"good": Text("✓", "green"), "note": Text("!", "yellow"), "bad": Text("✗", "bold red")}
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_header=False)
    table.add_column("")
    table.add_column("", no_wrap=True)
    table.add_column("", overflow="fold")
    for finding in findings:
        table.add_row(marks[finding.state], finding.name, Text(finding.text))
    return table


def studies_table(found: Sequence[Any]) -> Table:
    """One row a study: how far it is."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", no_wrap=True)
    for name in ("runs", "done", "failed", "missing"):
        table.add_column(name, justify="right", no_wrap=True)
    for each in found:
        missing = each.runs - each.done - len(each.failed)
        cells = (each.runs, each.done, len(each.failed), missing)
        table.add_row(Text(each.name), *map(str, cells))
    return table


def topics_table(found: Sequence[Any]) -> Table:
    """One row a topic of the paper: what it asks, and how many runs it takes."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", no_wrap=True)
    table.add_column("section", no_wrap=True)
    table.add_column("levels × seeds", no_wrap=True, justify="right")
    table.add_column("claims", justify="right")
    table.add_column("question", overflow="fold")
    for each in found:
        size = f"{each.cells} × {each.seeds}"
        table.add_row(
            Text(each.name), each.section, size, str(len(each.claims)), Text(each.question)
        )
    return table


def claims_table(decisions: Mapping[str, Sequence[Any]]) -> Table:
    """One row a claim: its verdict."""
    styles = {"holds": "green", "does not hold": "bold red", "undecided": "yellow"}
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim", overflow="fold")
    for topic, of_topic in decisions.items():
        for decision in of_topic:
            verdict = Text(decision.verdict, styles[decision.verdict])
            table.add_row(topic, verdict, Text(decision.claim.sentence))
    return table
