"""The results of a study's runs, read from their folders, never from a live agent."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from touchdown.core import records
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray
from touchdown.envs.outcome import threshold_of
from touchdown.evaluation.evaluation import Evaluation, read_evaluations
from touchdown.runs.folder import RunFolder
from touchdown.runs.rows import EpisodeRow, ValidationRow
from touchdown.runs.run import Run
from touchdown.stats import curves
from touchdown.studies.plan import Study
from touchdown.studies.store import Store
from touchdown.studies.tuners import Tuned
from touchdown.studies.work import GAINS, LAST, PidJob

METRICS = {
    "best_return": "test return of the chosen checkpoint",
    "last_return": "test return of the last weights",
    "early_return": "mean validation return over the first third of training",
    "area": "mean validation return over training",
    "hover_share": "share of training episodes that ran 1000 steps",
    "worst_return": "least of the test returns",
}
"""What claims and comparisons may be about, a number a run, return points or shares."""
_BINS = 24  # of training, for the share of episodes that run to the limit


@dataclass(frozen=True, slots=True)
class RunResult:
    """One finished run in numbers."""

    path: Path
    """Its folder."""
    labels: tuple[str, ...]
    seed: int
    best_return: float
    last_return: float
    early_return: float
    area: float
    hover_share: float
    worst_return: float
    share_solved: float
    landed: float
    observations: int
    seconds: float
    observations_to_solved: float
    """Observations at the first validation that reached the environment's threshold; ∞ if none
    did."""
    seconds_to_solved: float
    validations: tuple[tuple[float, ...], tuple[float, ...]]
    """Observations, and mean returns."""
    hovering: tuple[tuple[float, ...], tuple[float, ...]]
    """Observations, and the share of the training episodes until then, from the one before, that
    ran to the time limit; bins without an episode's end are left out."""

    @property
    def name(self) -> str:
        """Its folder's; a study's runs are called by their digests."""
        return self.path.name


@dataclass(frozen=True, slots=True)
class StudyResults:
    """A study's finished runs, and those that are missing."""

    study: Study
    seeds: int
    runs: tuple[RunResult, ...]
    missing: int
    failed: dict[str, str]
    """Why, by digest."""

    @property
    def planned(self) -> int:
        """Runs of the study."""
        return len(self.study.cells()) * self.seeds

    def values(self, labels: tuple[str, ...], metric: str = "best_return") -> FloatArray:
        """One number a finished seed of a cell, [n], in the order of the seeds.

        Args:
            labels: of the cell.
            metric: one of `METRICS`.
        """
        return np.array([getattr(run, metric) for run in self.of(labels)], float)

    def of(self, labels: tuple[str, ...]) -> list[RunResult]:
        """The finished runs of a cell."""
        return [run for run in self.runs if run.labels == labels]

    def table(self) -> pl.DataFrame:
        """A row a finished run: its cell, seed and numbers; null where it never got there."""
        rows: list[dict[str, Any]] = []
        for run in self.runs:
            row: dict[str, Any] = {"study": self.study.name}
            row |= {
                factor.name: label
                for factor, label in zip(self.study.factors, run.labels, strict=True)
            }
            row |= {"seed": run.seed, "run": run.name}
            row |= {name: getattr(run, name) for name in METRICS}
            row |= {
                "share_solved": run.share_solved,
                "landed": run.landed,
                "observations": run.observations,
                "seconds": run.seconds,
                "observations_to_solved": _finite(run.observations_to_solved),
                "seconds_to_solved": _finite(run.seconds_to_solved),
            }
            rows.append(row)
        return pl.DataFrame(rows, infer_schema_length=None)


def read_study(study: Study, seeds: int, store: Store) -> StudyResults:
    """All that is known of a study.

    Raises:
        UserError: a finished run's files are broken.
    """
    failures = store.failed()
    runs: list[RunResult] = []
    failed: dict[str, str] = {}
    missing = 0
    for planned in study.runs(seeds):
        path = store.runs / planned.digest
        if Run(RunFolder(path)).status == "finished":
            runs.append(read_run(path, planned.cell.labels, planned.seed))
        elif planned.digest in failures:
            failed[planned.digest] = failures[planned.digest]
        else:
            missing += 1
    return StudyResults(study, seeds, tuple(runs), missing, failed)


def read_run(path: Path, labels: tuple[str, ...], seed: int) -> RunResult:
    """A finished run in numbers.

    Args:
        path: the run's folder.
        labels: of its cell.
        seed: its training seed.

    Raises:
        UserError: its files are broken.
    """
    folder = RunFolder(path)
    chosen = read_evaluations(folder.evaluation)[0]
    last = read_evaluations(path / LAST)[0] if (path / LAST).is_file() else chosen
    episodes = records.decode_jsonl(folder.episodes, EpisodeRow)
    validations = records.decode_jsonl(folder.validations, ValidationRow)
    if not episodes or not episodes[-1].env_steps:
        raise UserError(f"{folder.episodes}: has no steps, though its run is finished")
    if not validations:
        raise UserError(f"{folder.validations}: is empty, though its run is finished")
    at = [float(row.env_steps) for row in validations]
    means = [row.mean_return for row in validations]
    ends = np.array([row.env_steps for row in episodes], float)
    timed_out = [row.outcome == "timed out" for row in episodes]
    threshold = threshold_of(chosen.env_id)
    solved = math.inf if threshold is None else curves.first_reaching(at, means, threshold)
    until = float(ends[-1])
    seconds = [row.seconds for row in episodes]
    return RunResult(
        path=path,
        labels=labels,
        seed=seed,
        best_return=chosen.summary.mean,
        last_return=last.summary.mean,
        early_return=curves.area_under(at, means, until / 3),
        area=curves.area_under(at, means, until),
        hover_share=float(np.mean(timed_out)),
        worst_return=min(episode.episode_return for episode in chosen.episodes),
        share_solved=chosen.summary.share_solved or 0.0,
        landed=chosen.summary.outcomes.get("landed", 0.0),
        observations=int(until),
        seconds=seconds[-1],
        observations_to_solved=solved,
        seconds_to_solved=solved if math.isinf(solved) else float(np.interp(solved, ends, seconds)),
        validations=(tuple(at), tuple(means)),
        hovering=_hovering(ends, timed_out),
    )


def _hovering(
    ends: FloatArray, timed_out: Sequence[bool]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    edges: FloatArray = np.linspace(0.0, float(ends[-1]), _BINS + 1)
    place = np.clip(np.searchsorted(edges, ends, side="left") - 1, 0, _BINS - 1)
    counts = np.bincount(place, minlength=_BINS)
    over = np.bincount(place, weights=np.asarray(timed_out, float), minlength=_BINS)
    seen = counts > 0
    return tuple(edges[1:][seen].tolist()), tuple((over[seen] / counts[seen]).tolist())


@dataclass(frozen=True, slots=True)
class PidResult:
    """One tuning of the PID, and its test episodes."""

    job: PidJob
    trained_return: float
    """The best mean over the training starts of the trials."""
    history: tuple[float, ...]
    test: Evaluation
    gains: Path
    """Their file."""


def read_pid(jobs: Sequence[PidJob], store: Store) -> list[PidResult]:
    """Those tunings that are done.

    Raises:
        UserError: their files are broken.
    """
    found: list[PidResult] = []
    for job in jobs:
        folder = store.runs / job.digest
        if not job.is_done(store.runs):
            continue
        tuned = records.decode_json(folder / "tuning.json", Tuned)
        test = read_evaluations(folder / "evaluation.json")[0]
        found.append(PidResult(job, tuned.best_return, tuned.history, test, folder / GAINS))
    return found


def _finite(value: float) -> float | None:
    return None if math.isinf(value) else value
