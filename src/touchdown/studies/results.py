"""The results of a study: the finished runs of each cell, from this machine or imported."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import Run
from touchdown.studies import run_lines
from touchdown.studies.metrics import METRICS, TEST_METRICS
from touchdown.studies.plan import BETWEEN_LABELS, PlannedRun, Study
from touchdown.studies.run_lines import RunLine
from touchdown.studies.run_result import RunResult, read_run
from touchdown.studies.store import Store

_NUMBERS = tuple(each.name for each in dataclasses.fields(RunResult) if each.type is float)
_TIMES = ("env_steps_to_solved", "seconds_to_solved")  # ∞ if they are unknown
_LATER = ("last_share_solved",)  # lines of earlier versions lack them
_MAY_BE_UNKNOWN = (*_TIMES, *TEST_METRICS, "landed", "rewarded_share")


@dataclass(frozen=True, slots=True)
class StudyResults:
    """A study's finished and missing runs."""

    study: Study
    seeds: int
    runs: tuple[RunResult, ...]
    missing: int
    failed: dict[str, str]
    """Reason for each failure, by digest."""

    @property
    def planned(self) -> int:
        """Number of runs of the study."""
        return len(self.runs) + len(self.failed) + self.missing

    def values(self, labels: tuple[str, ...], metric: str = "best_return") -> FloatArray:
        """One number per finished seed of a cell, [n], in the order of the seeds.

        Runs that do not have the number are left out.

        Args:
            labels: the cell's labels.
            metric: one of `METRICS`.
        """
        found = np.array([getattr(run, metric) for run in self.of(labels)], float)
        return found[~np.isnan(found)]

    def named(self, cell: str, metric: str) -> FloatArray:
        """One number per finished seed of a cell, [n], for claims.

        Args:
            cell: its name.
            metric: one of `METRICS`.
        """
        return self.named_until(cell, metric, self.seeds)

    def named_until(self, cell: str, metric: str, seeds: int) -> FloatArray:
        """Like `named`, of the first planned seeds alone.

        Args:
            cell: its name.
            metric: one of `METRICS`.
            seeds: number of planned seeds, of which some may not have finished.
        """
        end = self.study.first_seed + seeds
        known = [
            getattr(run, metric)
            for run in self.runs
            if run.seed < end and BETWEEN_LABELS.join(run.labels) == cell
        ]
        return np.array(known, float)

    def of(self, labels: tuple[str, ...]) -> list[RunResult]:
        """The finished runs of a cell."""
        return [run for run in self.runs if run.labels == labels]

    def table(self) -> pl.DataFrame:
        """A row for each finished run: cell, seed and numbers; null for missing ones."""
        rows: list[dict[str, Any]] = []
        for run in self.runs:
            row: dict[str, Any] = {"study": self.study.name}
            row |= {
                factor.name: label
                for factor, label in zip(self.study.factors, run.labels, strict=True)
            }
            row |= {"seed": run.seed, "run": run.name}
            row |= {name: _finite(getattr(run, name)) for name in METRICS}
            if run.test is not None:
                row |= {
                    "sd": run.test.sd_return,
                    "iqm": run.test.iqm.value,
                    "worst_5%": run.test.worst_5_percent,
                }
            row |= {
                "landed": _finite(run.landed),
                "observations": run.env_steps,
                "seconds": run.seconds,
                "observations_to_solved": _finite(run.env_steps_to_solved),
                "seconds_to_solved": _finite(run.seconds_to_solved),
            }
            rows.append(row)
        return pl.DataFrame(rows, infer_schema_length=None)


def read_study(
    study: Study, seeds: int, store: Store, known: dict[str, RunResult] | None = None
) -> StudyResults:
    """Read all finished runs of a study.

    Args:
        study: the study.
        seeds: training seeds per cell.
        store: store of the runs.
        known: runs that have been read already, by digest; those that are read now are added.

    Raises:
        UserError: a finished run's files are broken.
    """
    known = {} if known is None else known
    failures = store.failed()
    imported = store.imported
    runs: list[RunResult] = []
    failed: dict[str, str] = {}
    missing = 0
    for planned in study.runs(seeds):
        path = store.runs / planned.digest
        if planned.digest in known:
            run = dataclasses.replace(known[planned.digest], labels=planned.cell.labels)
        elif Run(RunFolder(path)).status == "finished":
            run = read_run(path, planned.cell.labels, planned.seed)
        elif planned.digest in imported:
            run = _of_line(imported[planned.digest], path, planned)
        elif planned.digest in failures:
            failed[planned.digest] = failures[planned.digest]
            continue
        else:
            missing += 1
            continue
        known[planned.digest] = run
        runs.append(run)
    return StudyResults(study, seeds, tuple(runs), missing, failed)


def line_of(run: RunResult, study: Study) -> RunLine:
    """A run's results as a line for another machine.

    Args:
        run: a run.
        study: its study.
    """
    return RunLine(
        run=run.name,
        study=study.name,
        level=BETWEEN_LABELS.join(run.labels),
        seed=run.seed,
        origin=run.origin,
        numbers=run_lines.as_numbers({name: getattr(run, name) for name in _NUMBERS}),
        env_steps=run.env_steps,
        test=run.test,
        validations=run.validations,
        parts=run.parts,
    )


def check_line(line: RunLine) -> None:
    """Check that a line has all numbers of a run.

    Raises:
        UserError: it lacks one.
    """
    missing = next(
        (name for name in _NUMBERS if name not in line.numbers and name not in _LATER), None
    )
    if missing is not None:
        raise UserError(f"run {line.run}: numbers: {missing!r} is missing")
    for name in _NUMBERS:
        if line.numbers.get(name) is None and name not in _MAY_BE_UNKNOWN:
            raise UserError(f"run {line.run}: numbers: {name} = None: must be a number")


def _of_line(line: RunLine, path: Path, planned: PlannedRun) -> RunResult:
    """The results in a line; `path` is the folder that the run would have."""
    check_line(line)
    unknown = {name: math.inf if name in _TIMES else math.nan for name in _NUMBERS}
    known = {name: number for name in _NUMBERS if (number := line.numbers.get(name)) is not None}
    return RunResult(
        path=path,
        labels=planned.cell.labels,
        seed=planned.seed,
        env_steps=line.env_steps,
        test=line.test,
        validations=line.validations,
        origin=line.origin,
        parts=line.parts,
        **(unknown | known),
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
