"""What the verbs of studies do, as functions for a notebook."""

import dataclasses
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from touchdown.api import views
from touchdown.config import presets, toml
from touchdown.core import device, files, progress
from touchdown.core.errors import Interrupted, UserError
from touchdown.figures import importance
from touchdown.report import comparison as comparisons
from touchdown.report import study as reports
from touchdown.report.study import Report
from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run
from touchdown.studies import paper, plan, runner
from touchdown.studies import store as stores
from touchdown.studies.estimate import Estimate, estimate
from touchdown.studies.executors import Executor, LocalExecutor
from touchdown.studies.job import Job
from touchdown.studies.paper import SCALES, Scale
from touchdown.studies.plan import Study
from touchdown.studies.runner import State
from touchdown.studies.store import DEFAULT_RESULTS, Begun, Store
from touchdown.studies.work import PidJob

PAPER = "paper"
"""The name of all the paper's studies together."""


@dataclass(frozen=True, slots=True)
class Planned:
    """What is to be run under one name."""

    name: str
    scale: Scale
    file: Path | None
    studies: tuple[tuple[Study, int], ...]
    """Each with its number of seeds."""
    pid_jobs: tuple[PidJob, ...]
    seeds: int | None
    """As it was asked for."""

    @property
    def jobs(self) -> list[Job]:
        """The PID's tunings first, for they are short, then all training runs."""
        return [*self.pid_jobs, *runner.jobs_of(self.studies)]

    @property
    def command(self) -> str:
        """What runs it again."""
        words = ["touchdown", "study", "run", str(self.file or self.name)]
        words += [] if self.file else ["--scale", self.scale]
        words += [] if self.seeds is None else ["--seeds", str(self.seeds)]
        return shlex.join(words)

    def names(self) -> Mapping[str, str]:
        """What each job is called, by its digest: the first study that plans it, level, seed."""
        found: dict[str, str] = {
            job.digest: f"pid {job.tuning.tuner}, seed {job.tuning.seed}" for job in self.pid_jobs
        }
        for study, seeds in self.studies:
            for run in study.runs(seeds):
                name = f"{study.name} {run.cell.name}, seed {run.seed}"
                found.setdefault(run.digest, name)
        return found


def planned(name: str, *, scale: str = "quick", seeds: int | None = None) -> Planned:
    """What a name means.

    Args:
        name: `paper`, one of its topics, or the path of a study's TOML file.
        scale: of the paper's studies: `quick` or `full`.
        seeds: training seeds of each cell, if not the study's own number.

    Raises:
        UserError: there is no such study, or its file is broken.
    """
    if scale not in SCALES:
        raise UserError(f"scale = {scale!r}: must be one of {', '.join(SCALES)}")
    if seeds is not None:
        plan.check_seeds(seeds)
    topics = paper.topics(scale)
    if name == PAPER or name in topics:
        wanted = list(topics.values()) if name == PAPER else [topics[name]]
        studies = {topic.study.name: topic.study for topic in wanted if topic.study}
        with_pid = any(topic.study is None for topic in wanted)
        return Planned(
            name,
            scale,
            None,
            tuple((study, seeds or study.seeds) for study in studies.values()),
            tuple(paper.pid_jobs(scale, seeds)) if with_pid else (),
            seeds,
        )
    if not name.endswith(".toml"):
        known = ", ".join((PAPER, *topics))
        raise UserError(f"study {name!r}: unknown; choose one of {known}, or a .toml file")
    study = plan.from_toml(Path(name))
    if study.name in (PAPER, *topics):
        raise UserError(f"{name}: name = {study.name!r}: is one of the paper's; choose another")
    return Planned(study.name, scale, Path(name), ((study, seeds or study.seeds),), (), seeds)


def run_study(
    name: str,
    *,
    scale: str = "quick",
    seeds: int | None = None,
    executor: Executor | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    console: Console | None = None,
) -> State:
    """Run what is missing of a study; what is done already, in any study, is not done again.

    Args:
        name: `paper`, one of its topics, or the path of a study's TOML file.
        scale: of the paper's studies: `quick` or `full`.
        seeds: training seeds of each cell, if not the study's own number.
        executor: who does it; a worker process a core of this machine if None.
        results_dir: where results are kept.
        console: where to show progress; quiet if None.

    Returns:
        How it ended; it names the runs that failed.

    Raises:
        UserError: there is no such study, its file is broken, the folder is of another version or
            in use, or nothing can be written; what is done stays.
        Interrupted: Ctrl-C or SIGTERM; what was under way was saved.
    """
    what = planned(name, scale=scale, seeds=seeds)
    shown = console or Console(quiet=True)
    store = stores.open_store(Path(results_dir), make=True)
    stores.note_begun(
        store,
        Begun(what.name, what.scale, seeds or 0, None if what.file is None else str(what.file)),
    )
    names = what.names()
    try:
        with (
            views.StudyView(shown, what.name, lambda digest: names[digest]) as view,
            progress.stop_on_signals(shown) as stop,
        ):
            return runner.run_jobs(
                what.jobs,
                store,
                executor or LocalExecutor(),
                on_state=view.update,
                should_stop=stop,
            )
    except Interrupted:
        raise Interrupted(f"stopped and saved; go on with: {what.command}") from None


def estimate_study(
    name: str,
    *,
    scale: str = "quick",
    seeds: int | None = None,
    workers: int | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    console: Console | None = None,
) -> Estimate:
    """How long a study will take, from the speed that its kinds of run have here.

    Kinds of which runs are finished are known; each other one is flown for a second or two.

    Args:
        name: `paper`, one of its topics, or the path of a study's TOML file.
        scale: of the paper's studies: `quick` or `full`.
        seeds: training seeds of each cell, if not the study's own number.
        workers: runs at a time; as many as there are cores if None.
        results_dir: where results are kept, if there are any.
        console: where to show progress; quiet if None.

    Raises:
        UserError: there is no such study, or its file is broken.
    """
    what = planned(name, scale=scale, seeds=seeds)
    runs = runner.jobs_of(what.studies)
    count = LocalExecutor(workers).workers
    path = Path(results_dir)
    store = stores.open_store(path) if path.exists() else Store(path)
    shown = console or Console(quiet=True)
    with progress.counting(shown, "measuring how fast runs are", 1.0) as counter:
        return estimate(
            runs, what.pid_jobs, store, count, lambda done: counter.describe("measuring", done)
        )


@dataclass(frozen=True, slots=True)
class Status:
    """How far one study is."""

    name: str
    runs: int
    done: int
    failed: dict[str, str]
    """Why, by the run's name."""

    def to_dict(self) -> dict[str, Any]:
        """As values for JSON."""
        return dataclasses.asdict(self)


def study_status(
    name: str | None = None,
    *,
    scale: str | None = None,
    seeds: int | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
) -> list[Status]:
    """How far studies are.

    Args:
        name: of one; None takes all that were begun in the folder.
        scale: of the paper's; as it was last run if None.
        seeds: as it was last run if None.
        results_dir: where results are kept.

    Raises:
        UserError: there is no such folder or study.
    """
    store = stores.open_store(Path(results_dir))
    found: list[Status] = []
    failures = store.failed()
    for what in _begun(store, name, scale, seeds):
        names = what.names()
        studies: list[tuple[str, Sequence[Job]]] = [
            (study.name, runner.jobs_of([(study, n)])) for study, n in what.studies
        ]
        if what.pid_jobs:
            studies.append(("pid", what.pid_jobs))
        for label, jobs in studies:
            missing = {job.digest for job in store.missing(jobs)}
            failed = {names[d]: failures[d] for d in sorted(missing) if d in failures}
            found.append(Status(label, len(jobs), len(jobs) - len(missing), failed))
    return found


def study_report(
    name: str | None = None,
    *,
    scale: str | None = None,
    seeds: int | None = None,
    out: Path | str | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    console: Console | None = None,
) -> Report:
    """Write a study's page: figures, verdicts on its claims, flights, tables.

    Args:
        name: of a study; None takes the one that was begun, if it is one.
        scale: of the paper's; as it was last run if None.
        seeds: as it was last run if None.
        out: folder for the page; in the folder of results if None, and then it links to the runs.
        results_dir: where results are kept.
        console: where to show progress; quiet if None.

    Raises:
        UserError: there is no such folder or study, none of its runs is done, or the page cannot
            be written.
    """
    store = stores.open_store(Path(results_dir))
    begun = _begun(store, name, scale, seeds)
    if len(begun) > 1:
        names = ", ".join(what.name for what in begun)
        raise UserError(f"name: must be one of {names}, for several studies were begun")
    what = begun[0]
    if len(store.missing(what.jobs)) == len(what.jobs):
        raise UserError(f"study {what.name!r}: none of its runs is done; begin: {what.command}")
    folder = Path(out) if out is not None else store.path / "reports" / what.name
    command = _command_of_page(what, store, out)
    device.use_default()
    shown = console or Console(quiet=True)
    sections = 1 if what.file else len(paper.topics(what.scale)) if what.name == PAPER else 1
    with progress.counting(shown, f"report of {what.name}", sections) as count:

        def step(_name: str) -> None:
            count()

        if what.file is not None:
            ((study, n),) = what.studies
            return reports.write_study_report(
                study, n, store, folder, command=command, linked=out is None, on_step=step
            )
        return reports.write_paper_report(
            what.scale,
            what.seeds,
            store,
            folder,
            names=None if what.name == PAPER else [what.name],
            command=command,
            linked=out is None,
            on_step=step,
        )


def _command_of_page(what: Planned, store: Store, out: Path | str | None) -> str:
    """What runs the study and writes its page, from nothing."""
    where = [] if store.path == DEFAULT_RESULTS else ["--results-dir", str(store.path)]
    to = [] if out is None else ["--out", str(out)]
    report = shlex.join(["touchdown", "study", "report", what.name, *to, *where])
    return f"{shlex.join([*shlex.split(what.command), *where])} && {report}"


@dataclass(frozen=True, slots=True)
class Listed:
    """One of the paper's topics."""

    name: str
    section: str
    question: str
    cells: int
    seeds: int
    claims: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As values for JSON."""
        return dataclasses.asdict(self)


def list_studies(scale: str = "quick") -> list[Listed]:
    """The paper's topics at a scale.

    Raises:
        UserError: there is no such scale.
    """
    if scale not in SCALES:
        raise UserError(f"scale = {scale!r}: must be one of {', '.join(SCALES)}")
    found: list[Listed] = []
    for topic in paper.topics(scale).values():
        tunings = paper.pid_jobs(scale)
        seeds = len({job.tuning.seed for job in tunings})
        cells = len(tunings) // seeds
        if topic.study is not None:
            cells, seeds = len(topic.study.cells()), topic.study.seeds
        claims = tuple(claim.sentence for claim in topic.claims)
        found.append(Listed(topic.name, topic.section, topic.question, cells, seeds, claims))
    return found


def executor_of(on: str, workers: int | None = None) -> Executor:
    """Who runs jobs, by what `--on` says.

    Args:
        on: `local`, `ray` for a cluster that this machine belongs to, or `ray://host:port`.
        workers: jobs at a time, if not as many as there are cores.

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


def compare(
    names: Sequence[str],
    *,
    out: Path | str = "comparison",
    runs_dir: Path | str = DEFAULT_RUNS,
    console: Console | None = None,
) -> Path:
    """Write one page that compares runs; those that differ in nothing but the seed count as one.

    Args:
        names: of finished runs; the first one's settings are what the others are beside.
        out: folder for the page.
        runs_dir: where runs are kept.
        console: where to show progress; quiet if None.

    Returns:
        The page.

    Raises:
        UserError: there is no such run, one is not finished, or the page cannot be written.
    """
    device.use_default()
    runs = [Run(folders.find(name, Path(runs_dir))) for name in names]
    shown = console or Console(quiet=True)
    with progress.counting(shown, "comparing", 1) as count:
        page = comparisons.write_comparison(runs, Path(out))
        count()
    return page


@dataclass(frozen=True, slots=True)
class TunedAgent:
    """What a search has found, and the files that hold it."""

    value: float
    trials: int
    pruned: int
    changed: Mapping[str, Any]
    files: tuple[Path, ...]

    def __str__(self) -> str:
        """In a sentence."""
        settings = ", ".join(
            f"{name.split('.')[-1]} {value:.4g}" for name, value in self.changed.items()
        )
        return (
            f"best of {self.trials} trials ({self.pruned} pruned): validation return "
            f"{self.value:.1f} with {settings}"
        )


def tune_agent(
    preset: str,
    *,
    trials: int = 30,
    seeds: int = 3,
    observations: int | None = None,
    seed: int = 0,
    storage: str | None = None,
    out: Path | str | None = None,
    executor: Executor | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    console: Console | None = None,
) -> TunedAgent:
    """Search a preset's settings with Optuna; the same call goes on with a stopped search.

    A trial trains with several seeds that no study reports, and its value is the mean return on
    validation starts. One that is behind the median after some of its seeds is pruned.

    Args:
        preset: settings to start from.
        trials: to make in all, those made before too.
        seeds: training seeds a trial.
        observations: a training, if not as many as the preset's.
        seed: of the sampler.
        storage: Optuna's, such as `postgresql://…` for many machines; SQLite in the folder of
            results if None.
        out: TOML file for the winner; its importance plot lies beside it. None writes none.
        executor: runs a trial's seeds; worker processes of this machine if None.
        results_dir: where the trials' runs are kept.
        console: where to show progress; quiet if None.

    Raises:
        UserError: a number is out of range, Optuna is not installed, the storage cannot be
            reached, or nothing can be written.
        Interrupted: Ctrl-C or SIGTERM; the trials made are kept.
    """
    for name, value in (("trials", trials), ("seeds", seeds), ("observations", observations)):
        if value is not None and value < 1:
            raise UserError(f"{name} = {value}: must be at least 1")
    try:
        from touchdown.studies import search  # noqa: PLC0415 - an extra
    except ImportError:
        raise UserError(
            "tune agent: needs Optuna; install it: pip install 'touchdown[optuna]'"
        ) from None
    base = presets.preset(preset)
    if observations is not None:
        training = dataclasses.replace(
            base.training, max_env_steps=observations, episodes=1_000_000
        )
        base = dataclasses.replace(base, training=training)
    search.space_of(base)
    if out is not None and not Path(out).absolute().parent.is_dir():
        raise UserError(f"out {str(out)!r}: its folder does not exist")
    store = stores.open_store(Path(results_dir), make=True)
    url = storage or search.storage_url(store)
    study = search.open_study(url, f"{preset}-{base.digest}-{seeds}", seed)
    shown = console or Console(quiet=True)
    try:
        with (
            progress.counting(shown, f"searching {preset}", trials) as count,
            progress.stop_on_signals(shown) as stop,
        ):

            def told(number: int, best: float | None) -> None:
                words = "" if best is None else f", best {best:.1f}"
                count.describe(f"searching {preset}{words}", number)

            found = search.search(
                study,
                base,
                store,
                executor or LocalExecutor(),
                trials=trials,
                seeds=seeds,
                alone=storage is None,
                on_trial=told,
                should_stop=stop,
            )
    except Interrupted:
        raise Interrupted("stopped; the trials made are kept, the same command goes on") from None
    written: list[Path] = []
    if out is not None:
        path = Path(out)
        text = search.comment_of(found, preset, seeds) + toml.to_toml(found.best)
        with files.refusing(f"out {str(out)!r}"):
            files.write_atomic(path, text)
        written.append(path)
        if found.importance:
            plot = search.path_beside(path, "-importance.png")
            importance.save_importance(plot, found.importance)
            written.append(plot)
    return TunedAgent(found.value, found.trials, found.pruned, found.changed, tuple(written))


def _begun(
    store: Store, name: str | None, scale: str | None, seeds: int | None
) -> Sequence[Planned]:
    """What a name means, with the scale and the seeds that it was last run with."""
    known = {each.name: each for each in stores.list_begun(store)}

    def again(last: Begun) -> Planned:
        return planned(
            last.file or last.name, scale=scale or last.scale, seeds=seeds or last.seeds or None
        )

    if name is None:
        if not known:
            raise UserError(f"results_dir {str(store.path)!r}: no study was begun there")
        return [again(each) for each in known.values()]
    last = known.get(name) or known.get(Path(name).stem)
    if last is None:
        return [planned(name, scale=scale or "quick", seeds=seeds)]
    return [again(last)]
