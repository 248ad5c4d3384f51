"""Runs a study, or estimates how long it will take."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from touchdown.api import views
from touchdown.api.studies.find import READINGS, AnyStudy, StudySelection, find_study
from touchdown.core import installation, plugins
from touchdown.core.errors import Interrupted, UserError
from touchdown.core.progress import Counter, console_for, stop_on_signals
from touchdown.studies import runner
from touchdown.studies import store as stores
from touchdown.studies.estimate import Estimate, estimate
from touchdown.studies.executors import Executor, LocalExecutor
from touchdown.studies.job import Job
from touchdown.studies.plan import Study
from touchdown.studies.runner import State
from touchdown.studies.store import DEFAULT_RESULTS, StartedStudy, Store
from touchdown.studies.work import PidJob, TrainJob


def run_study(
    study: AnyStudy,
    *,
    scale: str = "quick",
    seeds: int | None = None,
    until_decided: bool = False,
    executor: Executor | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    trust: bool = False,
    progress: bool | None = None,
    console: Console | None = None,
) -> State:
    """Run a study; runs that are already done, in any study, are not repeated.

    A study made in Python is saved as a TOML file in the results folder, so that the command line
    can continue and report it.

    Args:
        study: a `Study`, the path of a study file, `paper`, `readings`, or one of its topics.
        scale: scale of the paper's studies: `quick` or `full`.
        seeds: training seeds of each cell; None uses the study's number.
        until_decided: whether to run from one of the study's looks to the next, with more seeds
            only for the cells of claims that are still open, until each is decided or given up.
        executor: runs the jobs; None uses one worker process per core of this machine.
        results_dir: folder that holds the runs and reports of studies.
        trust: whether to import code that a study file names: an environment's module or an agent.
            Code that a `Study` made in Python names is imported without it.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Returns:
        The final state, with the failed runs.

    Raises:
        UserError: there is no such study, its file is broken, the folder has another version or is
            in use, or nothing can be written; finished runs are kept.
        Interrupted: Ctrl-C, SIGTERM or SIGHUP; unfinished runs were saved.
    """
    selection = find_study(study, scale=scale, seeds=seeds)
    if until_decided:
        _check_looks(selection)
    _check_code(study, selection, trust=trust)
    shown = console_for(progress, console)
    store = stores.open_store(Path(results_dir), make=True)
    with stores.held(store):
        selection = _note_started(selection, store)
        runs = executor or LocalExecutor()
        try:
            if not until_decided:
                return _run_jobs(selection, selection.jobs, store, runs, shown)
            failed: dict[str, str] = {}  # which would fail again
            jobs = selection.jobs_until_decided(store)
            while True:
                state = _run_jobs(selection, jobs, store, runs, shown)
                failed |= state.failed
                needed = selection.jobs_until_decided(store)
                jobs = [each for each in needed if each.digest not in failed]
                if not store.missing(jobs):  # no claim that is open can get more seeds
                    return replace(state, failed=failed)
        except Interrupted:
            command = selection.command(store)
            raise Interrupted(f"stopped and saved; resume with: {command}") from None


def _check_looks(selection: StudySelection) -> None:
    """Check that a study can run until its claims are decided.

    Raises:
        UserError: it has no looks, or the number of seeds was given, too.
    """
    if not selection.has_looks:
        advice = "plan them, such as looks = [10, 20, 40]"
        if selection.is_paper:
            advice = "choose --scale full" if selection.name != READINGS else "leave it out"
        raise UserError(f"study {selection.name!r}: has no looks for --until-decided; {advice}")
    if selection.seeds is not None:
        raise UserError(f"seeds = {selection.seeds}: must be left out; the looks say how many")


def _run_jobs(
    selection: StudySelection,
    jobs: Sequence[Job],
    store: Store,
    executor: Executor,
    shown: Console,
) -> State:
    """Run jobs of a study and show their progress."""
    names = selection.job_names()
    with (
        views.StudyView(shown, selection.name, lambda digest: names[digest]) as view,
        stop_on_signals(shown) as stop,
    ):
        return runner.run_jobs(jobs, store, executor, on_state=view.update, should_stop=stop)


def _check_code(study: AnyStudy, selection: StudySelection, *, trust: bool) -> None:
    """Check that the runs may import the environments and agents that the study names.

    Raises:
        UserError: only a file names them.
    """
    with plugins.trusting(everything=trust or (isinstance(study, Study) and not study.from_file)):
        for job in selection.train_jobs:
            for field, name in job.config.own_code.items():
                plugins.check_allowed(name, field)


def _note_started(selection: StudySelection, store: Store) -> StudySelection:
    """Record that a study was started; one made in Python is saved as a study file."""
    # absolute, because the next command may be given in another folder
    file = None if selection.file is None else str(selection.file.absolute())
    started = StartedStudy(selection.name, selection.scale, selection.seeds or 0, file)
    if not selection.is_paper and selection.file is None:
        ((study, _),) = selection.studies
        selection = replace(selection, file=stores.keep(store, study))
    stores.note_started(store, started)
    return selection


def estimate_study(
    study: AnyStudy,
    *,
    scale: str = "quick",
    seeds: int | None = None,
    until_decided: bool = False,
    workers: int | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    trust: bool = False,
    progress: bool | None = None,
    console: Console | None = None,
) -> Estimate:
    """Estimate how long a study will take, from the speed of each kind of run on this machine.

    Finished runs show the speed of their kind; other kinds are trained for a few seconds.

    Args:
        study: a `Study`, the path of a study file, `paper`, `readings`, or one of its topics.
        scale: scale of the paper's studies: `quick` or `full`.
        seeds: training seeds of each cell; None uses the study's number.
        until_decided: whether to estimate the time to the study's next look.
        workers: number of parallel runs; None uses one per core.
        results_dir: folder that holds the runs of studies; it need not exist.
        trust: whether to import code that a study file names: an environment's module or an agent.
            Code that a `Study` made in Python names is imported without it.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Raises:
        UserError: there is no such study, or its file is broken.
    """
    selection = find_study(study, scale=scale, seeds=seeds)
    if until_decided:
        _check_looks(selection)
    _check_code(study, selection, trust=trust)
    count = LocalExecutor(workers).workers
    path = Path(results_dir)
    store = stores.open_store(path) if path.exists() else Store(path)
    shown = console_for(progress, console)
    with Counter(shown, "measuring the speed of runs", 1.0) as counter:
        runs, tunings = selection.train_jobs, selection.pid_jobs
        if until_decided:
            needed = selection.jobs_until_decided(store)
            runs = [job for job in needed if isinstance(job, TrainJob)]
            tunings = [job for job in needed if isinstance(job, PidJob)]
        return estimate(
            runs,
            tunings,
            store,
            count,
            lambda done: counter.describe("measuring", done),
            baselines=selection.baselines,
        )


def executor_of(on: str, workers: int | None = None) -> Executor:
    """The executor for a value of `--on`.

    Args:
        on: `local`, `ray` for a cluster that this machine belongs to, or `ray://host:port`.
        workers: parallel jobs; None uses one per core.

    Raises:
        UserError: there is no such place, or Ray is not installed.
    """
    if on == "local":
        return LocalExecutor(workers)
    if on == "ray" or on.startswith("ray://"):
        try:
            from touchdown.studies.ray_executor import RayExecutor  # noqa: PLC0415 - an extra
        except ImportError:
            raise installation.missing(f"on = {on!r}", "Ray", "ray") from None
        return RayExecutor(on, workers)
    raise UserError(f"on = {on!r}: must be local, ray or ray://host:port")
