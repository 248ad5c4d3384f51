"""The results of a study's PID tunings, read from their folders."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from touchdown.core import records
from touchdown.evaluation.evaluation import Evaluation, read_evaluations
from touchdown.studies.store import Store
from touchdown.studies.tuners import Tuned
from touchdown.studies.work import PidJob


@dataclass(frozen=True, slots=True)
class PidResult:
    """A PID tuning and its test episodes."""

    job: PidJob
    trained_return: float
    """The best trial's mean return over its training starts."""
    history: tuple[float, ...]
    test: Evaluation
    path: Path
    """Its folder."""


def read_pid(jobs: Sequence[PidJob], store: Store) -> list[PidResult]:
    """Read the tunings that have been tested.

    Raises:
        UserError: their files are broken.
    """
    found: list[PidResult] = []
    for job in jobs:
        folder = store.runs / job.digest
        if not job.has_results(store.runs):
            continue
        tuned = records.decode_json(folder / "tuning.json", Tuned)
        test = read_evaluations(folder / "evaluation.json")[0]
        found.append(PidResult(job, tuned.best_return, tuned.history, test, folder))
    return found
