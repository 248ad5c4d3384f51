"""Finds a study: a `Study`, a TOML file, one of the paper's topics, or all of them."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from touchdown.config.checks import is_plain_name
from touchdown.core.errors import UserError
from touchdown.core.names import hint
from touchdown.studies import looks, paper, plan, runner, study_file
from touchdown.studies import store as stores
from touchdown.studies.claims import CLAIMS
from touchdown.studies.job import Job
from touchdown.studies.paper import LOOKS, SCALES, Scale
from touchdown.studies.paper import looks as paper_looks
from touchdown.studies.paper.readings import reading_studies
from touchdown.studies.plan import Study
from touchdown.studies.store import DEFAULT_RESULTS, Store
from touchdown.studies.work import BaselineJob, PidJob, TrainJob

PAPER = "paper"
"""Name of all the paper's studies together."""
READINGS = "readings"
"""Name of the paper's studies in all readings together."""

AnyStudy = Study | Path | str
"""A study made in Python, the path of a study file, `paper`, `readings`, or one of the paper's
topics."""


@dataclass(frozen=True, slots=True)
class StudySelection:
    """All jobs of one study, or of the paper's studies."""

    name: str
    scale: Scale
    file: Path | None
    """The TOML file of a user's study; None for the paper's and for one made in Python."""
    studies: tuple[tuple[Study, int], ...]
    """Studies with their numbers of seeds."""
    pid_jobs: tuple[PidJob, ...]
    baselines: tuple[BaselineJob, ...]
    seeds: int | None
    """Requested number of seeds per cell; None for the studies' own numbers."""
    is_paper: bool
    """Whether it is the paper's, not a user's."""

    @property
    def in_looks(self) -> bool:
        """Whether it has looks, which say how many seeds it needs."""
        return self.seeds is None and self.has_looks

    @property
    def has_looks(self) -> bool:
        """Whether its claims are decided in looks."""
        if self.is_paper:
            return self.name != READINGS and bool(LOOKS[self.scale])
        return any(study.looks for study, _ in self.studies)

    def groups_until_decided(self, store: Store) -> list[tuple[str, Sequence[Job]]]:
        """Like `groups`, the jobs that open claims need now, done or not; for one with looks.

        Args:
            store: store of its results.

        Raises:
            UserError: a finished run's files are broken.
        """
        if not self.is_paper:
            ((study, _),) = self.studies
            return [(study.name, looks.next_jobs(study, store))]
        found: dict[str, Sequence[Job]] = {"baselines": self.baselines} if self.baselines else {}
        so_far = paper_looks.read_paper(self.scale, store)
        # first the tunings, which are short
        for name, topic in sorted(paper.topics(self.scale).items(), key=lambda of: of[0] != "pid"):
            if self.name in (PAPER, name):
                study = None if name == "alike" else topic.study
                found[name if study is None else study.name] = so_far.next_jobs(topic)
        return list(found.items())

    def jobs_until_decided(self, store: Store) -> list[Job]:
        """All jobs of `groups_until_decided`, without duplicates."""
        every = [job for _, jobs in self.groups_until_decided(store) for job in jobs]
        unique: dict[str, Job] = {}
        for job in every:
            if job.digest not in unique or job.needs_flights:
                unique[job.digest] = job
        return list(unique.values())

    @property
    def groups(self) -> list[tuple[str, Sequence[Job]]]:
        """The jobs by what they are for; several may have the same run."""
        if self.name == READINGS:
            seeds = {study.name: number for study, number in self.studies}
            found: list[tuple[str, Sequence[Job]]] = [
                (reading.name, runner.jobs_of([(each, seeds[each.name]) for each in studies]))
                for reading, studies in reading_studies(self.scale).items()
            ]
        else:
            found = [(each.name, runner.jobs_of([(each, n)])) for each, n in self.studies]
        found += [("pid", self.pid_jobs)] if self.pid_jobs else []
        found += [("baselines", self.baselines)] if self.baselines else []
        return found

    @property
    def train_jobs(self) -> list[TrainJob]:
        """All training runs, without duplicates."""
        if self.name != READINGS:
            return runner.jobs_of(self.studies)
        # one experiment in all readings, then the next, so that a stopped study has some whole
        by_study: dict[str, list[tuple[Study, int]]] = {}
        for study, seeds in self.studies:
            by_study.setdefault(study.name.partition(".")[0], []).append((study, seeds))
        return [job for studies in by_study.values() for job in runner.jobs_of(studies)]

    @property
    def jobs(self) -> list[Job]:
        """All jobs: first the short ones, baselines and PID tunings, then the training runs."""
        return [*self.baselines, *self.pid_jobs, *self.train_jobs]

    def command(self, store: Store | None = None) -> str:
        """The command that runs it, or the call for a study made in Python.

        Args:
            store: store of its results; None leaves it out of the command.
        """
        elsewhere = store is not None and store.path != DEFAULT_RESULTS
        if not self.is_paper and self.file is None:
            arguments = ["study"]
            arguments += [] if self.seeds is None else [f"seeds={self.seeds}"]
            arguments += ["until_decided=True"] if self.in_looks else []
            arguments += [f"results_dir={str(store.path)!r}"] if store and elsewhere else []
            return f"touchdown.run_study({', '.join(arguments)})"
        words = ["touchdown", "study", "run", str(self.file or self.name)]
        words += [] if self.file else ["--scale", self.scale]
        words += [] if self.seeds is None else ["--seeds", str(self.seeds)]
        words += ["--until-decided"] if self.in_looks else []
        words += ["--results-dir", str(store.path)] if store and elsewhere else []
        words += ["--trust"] if any(job.config.own_code for job in self.train_jobs) else []
        return shlex.join(words)

    def job_names(self) -> Mapping[str, str]:
        """A name for each job by its digest: its first study, its level and its seed."""
        found: dict[str, str] = {job.digest: f"baseline {job.name}" for job in self.baselines}
        tunings = self.pid_jobs
        if tunings and self.in_looks:
            tunings = paper.pid_jobs(self.scale, LOOKS[self.scale][-1])
        found |= {job.digest: f"pid {job.tuning.tuner}, seed {job.tuning.seed}" for job in tunings}
        for study, seeds in self.studies:
            for run in study.runs(max((seeds, *study.looks))):
                name = f"{study.name} {run.cell.name}, seed {run.seed}"
                found.setdefault(run.digest, name)
        return found


def find_study(
    study: AnyStudy, *, scale: str = "quick", seeds: int | None = None
) -> StudySelection:
    """The jobs of a study.

    Args:
        study: a `Study`, the path of a study file, `paper`, `readings`, or one of its topics.
        scale: scale of the paper's studies: `quick` or `full`.
        seeds: training seeds of each cell; None uses the study's number.

    Raises:
        UserError: there is no such study, or its file is broken.
    """
    if scale not in SCALES:
        raise UserError(f"scale = {scale!r}: {hint(scale, SCALES)}")
    if seeds is not None:
        plan.check_seeds(seeds)
    if isinstance(study, Study):
        return _own(study, None, scale, seeds)
    topics = paper.topics(scale)
    name = str(study)
    if name == READINGS:
        if not LOOKS[scale]:
            raise UserError(
                f"scale = {scale!r}: must be full for {READINGS}; the quick scale decides no claim"
            )
        each = [study for studies in reading_studies(scale).values() for study in studies]
        planned = tuple((study, seeds or study.seeds) for study in each)
        return StudySelection(name, scale, None, planned, (), (), seeds, is_paper=True)
    if name == PAPER or name in topics:
        wanted = list(topics.values()) if name == PAPER else [topics[name]]
        studies = {topic.study.name: topic.study for topic in wanted if topic.study}
        with_pid = any(topic.study is None for topic in wanted)
        with_baselines = any(topic.with_baselines for topic in wanted)
        return StudySelection(
            name,
            scale,
            None,
            tuple((study, seeds or study.seeds) for study in studies.values()),
            tuple(paper.pid_jobs(scale, seeds)) if with_pid else (),
            tuple(paper.baseline_jobs()) if with_baselines else (),
            seeds,
            is_paper=True,
        )
    if not name.endswith(".toml"):
        known = (PAPER, READINGS, *topics)
        listed = f"must be one of {', '.join(known)}, or a .toml file"
        raise UserError(f"study {name!r}: unknown; {hint(name, known, listed)}")
    return _own(study_file.from_toml(Path(name)), Path(name), scale, seeds)


def _own(study: Study, file: Path | None, scale: Scale, seeds: int | None) -> StudySelection:
    """The jobs of a user's study, from a file or made in Python."""
    where = "" if file is None else f"{file}: "
    if study.name in (PAPER, READINGS, *paper.topics(scale)):
        raise UserError(f"{where}name = {study.name!r}: is one of the paper's; choose another")
    if study.name == CLAIMS:
        raise UserError(
            f"{where}name = {study.name!r}: is reserved for the table of claims; choose another"
        )
    if seeds is not None:
        plan.check_seeds(seeds, study.first_seed)
    planned = ((study, seeds or study.seeds),)
    return StudySelection(study.name, scale, file, planned, (), (), seeds, is_paper=False)


def find_started(
    store: Store, study: AnyStudy, scale: str | None, seeds: int | None
) -> StudySelection:
    """The jobs of a study, at the scale and with the number of seeds that it was last run with.

    Args:
        store: the store in which it was run.
        study: a `Study`, the path of a study file, or a name.
        scale: scale of the paper's studies; None uses the scale of the last run.
        seeds: training seeds of each cell; None uses the number of the last run.

    Raises:
        UserError: there is no such study.
    """
    if isinstance(study, Study):
        last = stores.read_started(store, study.name)
        found = find_study(study, seeds=seeds or (last.seeds if last else 0) or None)
        kept = stores.kept_file(store, study)
        is_kept = kept.is_file() and study_file.from_toml(kept) == study
        return replace(found, file=kept) if is_kept else found
    name = str(study)
    last = stores.read_started(store, name) if is_plain_name(name) else None
    where = name if last is None else last.file or last.name
    if last is None and name.endswith(".toml"):
        # the file that was given, wherever the one of the last run is now
        last = stores.read_started(store, find_study(name).name)
    if last is None:
        usual = "full" if name == READINGS else "quick"
        return find_study(name, scale=scale or usual, seeds=seeds)
    return find_study(where, scale=scale or last.scale, seeds=seeds or last.seeds or None)


def find_each_started(
    store: Store, scale: str | None, seeds: int | None
) -> dict[str, StudySelection | UserError]:
    """Each study that was started in a store, as by `find_started`, or why it cannot be found.

    Raises:
        UserError: none was started.
    """
    found: dict[str, StudySelection | UserError] = {}
    for name in stores.list_started(store):
        try:
            found[name] = find_started(store, name, scale, seeds)
        except UserError as error:
            found[name] = error
    if not found:
        raise UserError(f"results_dir {str(store.path)!r}: no study was started there")
    return found
