"""A report and its files: the page, a summary in Markdown, and tables as CSV."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from touchdown.core import files
from touchdown.report.markdown import summary_of
from touchdown.report.page import Page, write_page
from touchdown.studies.claims import Decision
from touchdown.studies.results import StudyResults

PAGE = "index.html"
_SUMMARY = "summary.md"


@dataclass(frozen=True, slots=True)
class Report:
    """A page and its verdicts."""

    page: Path
    decisions: dict[str, list[Decision]]
    """By topic."""
    results: dict[str, StudyResults]
    """By study."""


def write_report(page: Page, tables: Mapping[str, pl.DataFrame], out: Path) -> Path:
    """Write a page, its summary and its tables into a folder.

    Args:
        page: a page whose pictures are drawn.
        tables: tables by name, for `tables/<name>.csv`.
        out: the folder.

    Returns:
        The page.

    Raises:
        UserError: something cannot be written.
    """
    write_page(page, out / PAGE)
    with files.refusing(str(out / _SUMMARY)):
        files.write_atomic(out / _SUMMARY, summary_of(page, out, PAGE))
    folder = out / "tables"
    with files.refusing(str(folder)):
        folder.mkdir(exist_ok=True)
        for name, table in tables.items():
            files.write_atomic(folder / f"{name}.csv", table.write_csv(float_precision=4))
    return out / PAGE


def run_tables(results: Mapping[str, StudyResults]) -> dict[str, pl.DataFrame]:
    """The runs of every study with results, for further analysis."""
    return {name: each.table() for name, each in results.items() if each.runs}


def claim_table(decisions: Mapping[str, Sequence[Decision]]) -> pl.DataFrame:
    """Every claim with its verdict and evidence."""
    return pl.DataFrame(
        [
            {
                "study": name,
                "section": decision.claim.section,
                "claim": decision.claim.sentence,
                "verdict": decision.verdict,
                "p": decision.p_value,
                "evidence": decision.evidence,
            }
            for name, each in decisions.items()
            for decision in each
        ]
    )
