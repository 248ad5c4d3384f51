"""Compares runs on one page."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from touchdown.core import progress
from touchdown.report.comparison import write_comparison
from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run


def compare(
    names: Sequence[str],
    *,
    out: Path | str = "comparison",
    runs_dir: Path | str = DEFAULT_RUNS,
    console: Console | None = None,
) -> Path:
    """Write one page that compares runs; runs that differ only in their seed form one level.

    Args:
        names: names of finished runs; the settings of the first are the baseline.
        out: folder for the page.
        runs_dir: folder of the runs.
        console: where to show progress; None shows nothing.

    Returns:
        The page.

    Raises:
        UserError: there is no such run, one is not finished, or the page cannot be written.
    """
    runs = [Run(folders.find(name, Path(runs_dir))) for name in names]
    shown = console or Console(quiet=True)
    with progress.counting(shown, "comparing", 1) as count:
        page = write_comparison(runs, Path(out))
        count()
    return page
