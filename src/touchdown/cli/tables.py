"""Results as tables for a terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from touchdown.api.doctor import Finding


def runs_table(facts: Sequence[Mapping[str, Any]]) -> Table:
    """One row per run."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("run", no_wrap=True)
    for name in ("preset", "env", "seed", "status", "episodes", "env steps", "minutes", "test"):
        text = name in ("preset", "env", "status")
        table.add_column(name, justify="left" if text else "right", no_wrap=True)
    for run in facts:
        if run["status"] == "broken":
            table.add_row(run["name"], "", "", "", Text("broken", style="bold red"))
            continue
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
    table.add_column("study", no_wrap=True)
    for name in ("runs", "done", "failed", "missing"):
        table.add_column(name, justify="right", no_wrap=True)
    for each in found:
        missing = each.runs - each.done - len(each.failed)
        cells = (each.runs, each.done, len(each.failed), missing)
        table.add_row(each.name, *map(str, cells))
    return table


def topics_table(found: Sequence[Any]) -> Table:
    """One row per topic of the paper: its question and number of runs."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", no_wrap=True)
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
    styles = {"holds": "green", "does not hold": "bold red", "undecided": "yellow"}
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim", overflow="fold")
    for topic, of_topic in decisions.items():
        for decision in of_topic:
            verdict = Text(decision.verdict, styles[decision.verdict])
            table.add_row(topic, verdict, decision.claim.sentence)
    return table
