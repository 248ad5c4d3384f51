"""Results as tables for a terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from touchdown.api.doctor import Finding

_RUNS: Mapping[str, bool] = {
    "run": False,
    "preset": False,
    "env": False,
    "seed": True,
    "status": False,
    "episodes": True,
    "env steps": True,
    "minutes": True,
    "test": True,
}
"""Columns of the table of runs, and whether they hold numbers."""
_LEAST_NEEDED = ("preset", "episodes", "minutes", "seed", "env steps", "env")
"""Columns that a narrow terminal goes without, in this order."""
_SHORTEST_NAME = 16  # characters of a run's name in one line; longer names continue below


def runs_table(facts: Sequence[Mapping[str, Any]], width: int) -> Table:
    """One row per run; a narrow terminal gets the more important columns.

    Args:
        facts: facts about runs, or the name and the error of a broken one.
        width: characters in a line.
    """
    rows = [_cells_of(run) for run in facts]
    shown = list(_RUNS)
    widths = {name: max(map(len, [name, *(row[name] for row in rows)])) for name in shown}
    widths["run"] = min(widths["run"], max(_SHORTEST_NAME, width // 3))
    for name in _LEAST_NEEDED:
        if sum(widths[each] for each in shown) + 3 * len(shown) <= width:
            break
        shown.remove(name)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in shown:
        folded = name == "run"
        table.add_column(
            name,
            justify="right" if _RUNS[name] else "left",
            no_wrap=not folded,
            overflow="fold",
        )
    for row in rows:
        style = "bold red" if row["status"] == "broken" else ""
        table.add_row(*(Text(row[n], style) if n == "status" else row[n] for n in shown))
    return table


def _cells_of(run: Mapping[str, Any]) -> dict[str, str]:
    if run["status"] == "broken":
        return dict.fromkeys(_RUNS, "") | {"run": run["name"], "status": "broken"}
    test = run["test"]
    return {
        "run": run["name"],
        "preset": run["preset"],
        "env": run["env_id"],
        "seed": str(run["seed"]),
        "status": run["status"],
        "episodes": f"{run['episodes']:,}",
        "env steps": f"{run['observations']:,}",
        "minutes": f"{run['seconds'] / 60:.1f}",
        "test": f"{test['mean']:z.1f} ± {test['sd']:.1f}" if test else "-",
    }


def findings_table(findings: Sequence[Finding]) -> Table:
    """One row per check of the doctor."""
    marks = {"good": Text("✓", "green"), "note": Text("!", "yellow"), "bad": Text("✗", "bold red")}
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_header=False)
    table.add_column("")
    table.add_column("", no_wrap=True)
    table.add_column("", overflow="fold")
    for finding in findings:
        table.add_row(marks[finding.state], finding.name, finding.text)
    return table


def studies_table(found: Sequence[Any]) -> Table:
    """One row per study: how many of its runs are done."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", overflow="fold")
    for name in ("runs", "done", "unfinished", "failed", "not started"):
        table.add_column(name, justify="right", no_wrap=True)
    for each in found:
        if each.error is not None:
            table.add_row(Text(each.name), *"?????")
            continue
        started = each.done, each.unfinished, len(each.failed)
        cells = (each.runs, *started, each.runs - sum(started))
        table.add_row(each.name, *map(str, cells))
    return table


def topics_table(found: Sequence[Any]) -> Table:
    """One row per topic of the paper: its question and number of runs."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", overflow="fold")
    table.add_column("section", no_wrap=True)
    table.add_column("levels × seeds", no_wrap=True, justify="right")
    table.add_column("claims", justify="right")
    table.add_column("question", overflow="fold")
    for each in found:
        size = f"{each.cells} × {each.seeds}"
        table.add_row(each.name, each.section, size, str(len(each.claims)), each.question)
    return table


def claims_table(decisions: Mapping[str, Sequence[Any]]) -> Table:
    """One row per claim: its verdict."""
    styles = {
        "holds": "green",
        "does not hold": "bold red",
        "no difference that matters": "cyan",
        "reached and exceeded": "green",
        "undecided": "yellow",
        "preview": "dim",
    }
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", overflow="fold")
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim", overflow="fold")
    for topic, of_topic in decisions.items():
        for decision in of_topic:
            verdict = Text(decision.verdict, styles[decision.verdict])
            table.add_row(topic, verdict, decision.claim.sentence)
    return table


def check_table(rows: Sequence[Any]) -> Table:
    """One row per simulated procedure: its worst rate, and from how many seeds it keeps it."""
    from touchdown.stats import simulation  # noqa: PLC0415 - it loads SciPy's statistics

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("procedure", overflow="fold")
    table.add_column("kind", no_wrap=True)
    table.add_column("worst rate", no_wrap=True, justify="right")
    table.add_column("keeps its limit from", justify="right")
    for row in simulation.summary_of(rows):
        table.add_row(*row)
    return table
