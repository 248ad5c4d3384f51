"""Finds a run on disk."""

from pathlib import Path

from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run


def show(run: str, runs_dir: Path | str = DEFAULT_RUNS) -> Run:
    """The run with that name.

    Args:
        run: name or folder of the run.
        runs_dir: folder of the runs.

    Raises:
        UserError: there is no such run.
    """
    return Run(folders.find(run, Path(runs_dir)))
