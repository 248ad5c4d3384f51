"""Finds a study by name: one of the paper's topics, all of them, or a TOML file."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from touchdown.core.errors import UserError
from touchdown.studies import paper, plan, runner
from touchdown.studies import store as stores
from touchdown.studies.job import Job
from touchdown.studies.paper import SCALES, Scale
from touchdown.studies.plan import Study
from touchdown.studies.store import DEFAULT_RESULTS, StartedStudy, Store
from touchdown.studies.work import BaselineJob, PidJob, TrainJob

PAPER = "paper"
"""Name of all the paper's studies together."""


@dataclass(frozen=True, slots=True)
class StudySelection:
    """The studies and jobs of one name."""

    name: str
    scale: Scale
    file: Path | None
    """The TOML file of a user's study; None for the paper's."""
    studies: tuple[tuple[Study, int], ...]
    """Studies with their numbers of seeds."""
    pid_jobs: tuple[PidJob, ...]
    baselines: tuple[BaselineJob, ...]
    seeds: int | None
    """Requested seeds per cell; None for the studies' own numbers."""

    @property
    def train_jobs(self) -> list[TrainJob]:
        """All training runs, without duplicates."""
        return runner.jobs_of(self.studies)

    @property
    def jobs(self) -> list[Job]:
        """All jobs: first the short ones, baselines and PID tunings, then the training runs."""
        return [*self.baselines, *self.pid_jobs, *self.train_jobs]

    def command(self, store: Store | None = None) -> str:
        """The command that runs it.

        Args:
            store: store of its results; None leaves it out of the command.
        """
        words = ["touchdown", "study", "run", str(self.file or self.name)]
        words += [] if self.file else ["--scale", self.scale]
        words += [] if self.seeds is None else ["--seeds", str(self.seeds)]
        if store is not None and store.path != DEFAULT_RESULTS:
            words += ["--results-dir", str(store.path)]
        return shlex.join(words)

    def job_names(self) -> Mapping[str, str]:
        """A name for each job by its digest: its first study, its level and its seed."""
        found: dict[str, str] = {job.digest: f"baseline {job.name}" for job in self.baselines}
        found |= {
            job.digest: f"pid {job.tuning.tuner}, seed {job.tuning.seed}" for job in self.pid_jobs
        }
        for study, seeds in self.studies:
            for run in study.runs(seeds):
                name = f"{study.name} {run.cell.name}, seed {run.seed}"
                found.setdefault(run.digest, name)
        return found


def find_study(name: str, *, scale: str = "quick", seeds: int | None = None) -> StudySelection:
    """Find a study by name.

    Args:
        name: `paper`, one of its topics, or the path of a study's TOML file.
        scale: scale of the paper's studies: `quick` or `full`.
        seeds: training seeds per cell; None uses the study's own number.

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
        with_baselines = any(topic.with_baselines for topic in wanted)
        return StudySelection(
            name,
            scale,
            None,
            tuple((study, seeds or study.seeds) for study in studies.values()),
            tuple(paper.pid_jobs(scale, seeds)) if with_pid else (),
            tuple(paper.baseline_jobs()) if with_baselines else (),
            seeds,
        )
    if not name.endswith(".toml"):
        known = ", ".join((PAPER, *topics))
        raise UserError(f"study {name!r}: unknown; choose one of {known}, or a .toml file")
    study = plan.from_toml(Path(name))
    if study.name in (PAPER, *topics):
        raise UserError(f"{name}: name = {study.name!r}: reserved for the paper's studies")
    if seeds is not None:
        plan.check_seeds(seeds, study.first_seed)
    of_file = ((study, seeds or study.seeds),)
    return StudySelection(study.name, scale, Path(name), of_file, (), (), seeds)


def find_started(
    store: Store, name: str | None, scale: str | None, seeds: int | None
) -> Sequence[StudySelection]:
    """Find studies by name, with the scale and the number of seeds of their last run.

    Args:
        store: the store in which it was run.
        name: name of a study; None uses all that were started in the store.
        scale: scale of the paper's studies; None uses that of the last run.
        seeds: training seeds per cell; None uses the number of the last run.

    Raises:
        UserError: there is no such study, or none was started.
    """
    known = {each.name: each for each in stores.list_started(store)}

    def again(last: StartedStudy) -> StudySelection:
        return find_study(
            last.file or last.name, scale=scale or last.scale, seeds=seeds or last.seeds or None
        )

    if name is None:
        if not known:
            raise UserError(f"results_dir {str(store.path)!r}: no study was started there")
        return [again(each) for each in known.values()]
    last = known.get(name)
    if last is None and name.endswith(".toml"):
        last = known.get(find_study(name).name)
    if last is None:
        return [find_study(name, scale=scale or "quick", seeds=seeds)]
    return [again(last)]
