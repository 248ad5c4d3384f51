"""Finds a run on disk."""

from pathlib import Path

from touchdown.core.errors import UserError
from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run

RunLike = str | Path | Run
"""A run, its name or its folder."""


def show(run: RunLike, runs_dir: Path | str = DEFAULT_RUNS) -> Run:
    """Open a run. A notebook shows its settings, its result and its learning curve.

    Args:
        run: a run, its name or its folder.
        runs_dir: folder that holds the runs.

    Raises:
        UserError: there is no such run.
    """
    return find_run(run, runs_dir)


def find_run(run: RunLike, runs_dir: Path | str = DEFAULT_RUNS) -> Run:
    """Find a run.

    Args:
        run: a run, its name or its folder.
        runs_dir: folder that holds the runs.

    Raises:
        UserError: there is no such run, or the argument has another type.
    """
    if isinstance(run, Run):
        return run
    if not isinstance(run, str | Path):  # pyright: ignore[reportUnnecessaryIsInstance] - as called
        raise UserError(f"run = {run!r}: must be a run, its name or its folder")
    return Run(folders.find(str(run), Path(runs_dir)))
