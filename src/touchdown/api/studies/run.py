"""Run a study, or estimate how long it will take."""

from pathlib import Path

from rich.console import Console

from touchdown.api import views
from touchdown.api.studies.find import find_study
from touchdown.core.errors import Interrupted, UserError
from touchdown.core.progress import Counter, console_for, stop_on_signals
from touchdown.studies import runner
from touchdown.studies import store as stores
from touchdown.studies.estimate import Estimate, estimate
from touchdown.studies.executors import Executor, LocalExecutor
from touchdown.studies.runner import State
from touchdown.studies.store import DEFAULT_RESULTS, StartedStudy, Store


def run_study(
    name: str,
    *,
    scale: str = "quick",
    seeds: int | None = None,
    executor: Executor | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    progress: bool | None = None,
    console: Console | None = None,
) -> State:
    """Run a study; runs that are done already, in any study, are not repeated.

    Args:
        name: `paper`, one of its topics, or the path of a study's TOML file.
        scale: of the paper's studies: `quick` or `full`.
        seeds: training seeds of each cell; None takes the study's own number.
        executor: does the jobs; None takes one worker process per core of this machine.
        results_dir: folder that holds the runs and reports of studies.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None takes the notebook's output or standard output.

    Returns:
        The state at the end, with the runs that failed.

    Raises:
        UserError: there is no such study, its file is broken, the folder is of another version or
            in use, or nothing can be written; finished runs stay.
        Interrupted: Ctrl-C or SIGTERM; unfinished runs were saved.
    """
    selection = find_study(name, scale=scale, seeds=seeds)
    shown = console_for(progress, console)
    store = stores.open_store(Path(results_dir), make=True)
    file = None if selection.file is None else str(selection.file)
    stores.note_started(store, StartedStudy(selection.name, selection.scale, seeds or 0, file))
    names = selection.job_names()
    try:
        with (
            views.StudyView(shown, selection.name, lambda digest: names[digest]) as view,
            stop_on_signals(shown) as stop,
        ):
            return runner.run_jobs(
                selection.jobs,
                store,
                executor or LocalExecutor(),
                on_state=view.update,
                should_stop=stop,
            )
    except Interrupted:
        raise Interrupted(f"stopped and saved; continue with: {selection.command()}") from None


def estimate_study(
    name: str,
    *,
    scale: str = "quick",
    seeds: int | None = None,
    workers: int | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    progress: bool | None = None,
    console: Console | None = None,
) -> Estimate:
    """Estimate how long a study will take, from the speed of each kind of run on this machine.

    Finished runs show the speed of their kind; every other kind is trained for a few seconds.

    Args:
        name: `paper`, one of its topics, or the path of a study's TOML file.
        scale: of the paper's studies: `quick` or `full`.
        seeds: training seeds of each cell; None takes the study's own number.
        workers: runs at the same time; None takes one per core.
        results_dir: folder that holds the runs of studies; it need not exist.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None takes the notebook's output or standard output.

    Raises:
        UserError: there is no such study, or its file is broken.
    """
    selection = find_study(name, scale=scale, seeds=seeds)
    count = LocalExecutor(workers).workers
    path = Path(results_dir)
    store = stores.open_store(path) if path.exists() else Store(path)
    shown = console_for(progress, console)
    with Counter(shown, "measuring how fast runs are", 1.0) as counter:
        return estimate(
            selection.train_jobs,
            selection.pid_jobs,
            store,
            count,
            lambda done: counter.describe("measuring", done),
            baselines=selection.baselines,
        )


def executor_of(on: str, workers: int | None = None) -> Executor:
    """The executor that `--on` names.

    Args:
        on: `local`, `ray` for a cluster that this machine belongs to, or `ray://host:port`.
        workers: jobs at the same time; None takes one per core.

    Raises:
        UserError: there is no such place, or Ray is not installed.
    """
    if on == "local":
        return LocalExecutor(workers)
    if on == "ray" or on.startswith("ray://"):
        try:
            from touchdown.studies.ray_executor import RayExecutor  # noqa: PLC0415 - an extra
        except ImportError:
            raise UserError(
                f"on = {on!r}: needs Ray; install it: pip install 'touchdown[ray]'"
            ) from None
        return RayExecutor(on, workers)
    raise UserError(f"on = {on!r}: must be local, ray or ray://host:port")
