"""Compares runs on one page."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from touchdown.api.runs import RunLike, find_run
from touchdown.core import files
from touchdown.core.progress import Counter, console_for
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run


def compare(
    runs: Sequence[RunLike] | RunLike,
    *,
    out: Path | str = "comparison",
    force: bool = False,
    runs_dir: Path | str = DEFAULT_RUNS,
    progress: bool | None = None,
    console: Console | None = None,
) -> Path:
    """Write one page that compares runs; runs that differ only in their seed form one level.

    Args:
        runs: finished runs, their names or their folders; the settings of the first are the
            baseline.
        out: folder for the page.
        force: whether to replace the page in an existing folder.
        runs_dir: folder that holds the runs.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Returns:
        The page.

    Raises:
        UserError: there is no such run, one is not finished, `out` exists already, or the page
            cannot be written.
    """
    given = [runs] if isinstance(runs, str | Path | Run) else runs
    found = [find_run(run, runs_dir) for run in given]
    files.check_new(Path(out), force=force)
    from touchdown.report.builder import STEPS  # noqa: PLC0415 - it loads matplotlib
    from touchdown.report.comparison import write_comparison  # noqa: PLC0415 - it loads matplotlib

    shown = console_for(progress, console)
    with Counter(shown, f"comparing {len(found)} runs", STEPS) as count:
        return write_comparison(found, Path(out), lambda _: count())
