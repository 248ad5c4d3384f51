"""A report and its files: the page, a summary in Markdown, and tables as CSV."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import polars as pl
import polars.selectors as cs

from touchdown.core import files
from touchdown.report.markdown import summary_of
from touchdown.report.page import Page, write_page
from touchdown.studies.claims import Decision
from touchdown.studies.results import StudyResults

PAGE = "index.html"
_SUMMARY = "summary.md"
_DIGITS = 8  # significant digits of a number in a table


@dataclass(frozen=True, slots=True)
class Report:
    """A page and its verdicts."""

    page: Path
    decisions: dict[str, list[Decision]]
    """Decisions by topic."""
    results: dict[str, StudyResults]
    """Results by study."""


def write_report(page: Page, tables: Mapping[str, pl.DataFrame], out: Path) -> None:
    """Write a page, its summary and its tables into a folder.

    Args:
        page: a page whose pictures are drawn.
        tables: tables by name, for `tables/<name>.csv`.
        out: the folder.

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
            rounded = table.with_columns(cs.float().round_sig_figs(_DIGITS))
            files.write_atomic(folder / f"{name}.csv", rounded.write_csv())
