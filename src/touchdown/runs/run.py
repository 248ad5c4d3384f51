"""A run on disk: its policy, results, pictures and a short description."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import msgspec

from touchdown.config.config import Config
from touchdown.core import notebook, reading, records
from touchdown.core.errors import UserError, one_line
from touchdown.core.progress import clock
from touchdown.core.records import Count, Seconds
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.evaluation import Evaluation
from touchdown.evaluation.rows import points, summary_rows
from touchdown.policies.named import NamedPolicy
from touchdown.policies.weights import load_weights
from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS, RunFolder
from touchdown.runs.over_training import SavedPolicy, policies_over_training
from touchdown.runs.rows import EpisodeRow
from touchdown.runs.training_flights import TrainingFlight, read_training_flights
from touchdown.stats.summary import Summary

CURVE, FLIGHTS, POLICY = "learning-curve.png", "flights.png", "policy.png"
GIF, MP4 = "flight.gif", "flight.mp4"
PICTURES = (CURVE, FLIGHTS, POLICY, GIF, MP4)
_DONE = CURVE  # the last file that a run writes
_MOST_BYTES = 4_000_000  # per picture in a notebook; a run's own pictures are smaller
_CURVE_WIDTH = 600  # pixels


@dataclass(frozen=True, slots=True)
class Run:
    """A run on disk, finished or not."""

    folder: RunFolder

    @property
    def name(self) -> str:
        """The run's name."""
        return self.folder.name

    @property
    def path(self) -> Path:
        """The run's folder."""
        return self.folder.path

    @property
    def config(self) -> Config:
        """The run's settings."""
        return self.folder.config()

    @property
    def policy(self) -> NamedPolicy:
        """The best policy found so far."""
        return load_run(self.folder)

    @property
    def evaluation(self) -> Evaluation | None:
        """The policy's test episodes; None while the run is not finished."""
        return next(iter(evaluations_of(self)), None)

    @property
    def training_flights(self) -> list[TrainingFlight]:
        """The training episodes so far, as starts and actions; empty if they were not recorded."""
        return read_training_flights(self.folder.training_flights)

    @property
    def policies_over_training(self) -> list[SavedPolicy]:
        """The policies before training and at the validations; empty if they were not saved."""
        return policies_over_training(self.folder)

    @property
    def pictures(self) -> list[Path]:
        """The run's pictures and films."""
        found = [self.path / name for name in PICTURES]
        return [path for path in found if path.is_file()]

    @property
    def status(self) -> Literal["finished", "unfinished"]:
        """Whether the run is finished."""
        return "finished" if (self.path / _DONE).is_file() else "unfinished"

    def __repr__(self) -> str:
        return f"<Run {notebook.plain(f'{self.name}: {_in_short(self)}')}>"

    def _repr_html_(self) -> str:
        """The facts and the learning curve, for a notebook."""
        try:
            return notebook.facts_html(self.name, _in_short(self), _facts(self), _curve(self))
        except (OSError, UserError) as error:
            return notebook.facts_html(self.name, f"broken: {one_line(error)}")


def load_run(folder: RunFolder) -> NamedPolicy:
    """The best policy found so far in a run.

    Raises:
        UserError: there is none yet, or the files are broken.
    """
    found = load_weights(best_weights(folder))
    return NamedPolicy(folder.name, found.policy, found.env_id, found.reward_scale)


def best_weights(folder: RunFolder) -> Path:
    """The file with the best weights found so far in a run.

    Raises:
        UserError: there is none yet.
    """
    if not folder.best.is_file():
        if folder.evaluation.is_file():
            raise UserError(
                f"{folder.best}: missing from a finished run; restore it from a copy, or choose it "
                f"again among its checkpoints with: touchdown train --resume {folder.name}"
            )
        raise UserError(
            f"run {folder.name!r}: has no weights before its first validation; "
            f"resume it with: {folder.resume_command()}"
        )
    return folder.best


def evaluations_of(run: Run) -> list[Evaluation]:
    """The test episodes of a run and of the baselines; empty while the run is not finished.

    Raises:
        UserError: `evaluation.json` is broken.
    """
    path = run.folder.evaluation
    return evaluations.read_evaluations(path) if path.is_file() else []


def _in_short(run: Run) -> str:
    """The environment, the state of the run and its result, or the error of a broken run."""
    try:
        env_id, status, evaluation = run.config.env_id, run.status, run.evaluation
    except (OSError, UserError) as error:
        return f"broken: {one_line(error)}"
    if status == "unfinished":
        return f"{env_id}, training not finished"
    if evaluation is None:
        return f"{env_id}, finished, not tested"
    mean, count = points(evaluation.summary.mean_return, 1), len(evaluation.episodes)
    return f"{env_id}, finished, test return {mean} (n={count})"


def _facts(run: Run) -> list[tuple[str, str]]:
    """The rows that `show` prints.

    Raises:
        UserError: the run's files are broken.
    """
    facts = describe(run)
    rows = [
        ("preset", facts.preset),
        ("training seed", str(facts.seed)),
        ("training episodes", f"{facts.episodes:,}"),
        ("environment steps", f"{facts.env_steps:,}"),
        ("training time", clock(facts.seconds)),
    ]
    if facts.test is not None:
        rows += [
            (name, cell(facts.test))
            for name, cell in summary_rows(facts.env_id, facts.test.threshold)
            if not name.startswith(" ")
        ]
    return rows


def _curve(run: Run) -> str:
    """The learning curve as HTML; "" while there is none."""
    path = run.path / CURVE
    if not path.is_file() or path.stat().st_size > _MOST_BYTES:
        return ""
    data = reading.read_bytes(path, _MOST_BYTES)
    return notebook.picture_html(data, "png", f"learning curve of {run.name}", width=_CURVE_WIDTH)


class RunFacts(msgspec.Struct, frozen=True, kw_only=True, rename={"env_steps": "observations"}):
    """A short description of a run."""

    name: str
    status: Literal["finished", "unfinished"]
    preset: str
    env_id: str
    seed: Count
    """Training seed."""
    config_digest: str
    episodes: Count
    """Training episodes so far."""
    env_steps: Count
    seconds: Seconds
    """Seconds of training so far."""
    test: Summary | None
    """Summary of the test episodes; None while the run is not finished."""

    def to_json(self) -> dict[str, Any]:
        """As a JSON object."""
        return msgspec.to_builtins(self)


def describe(run: Run) -> RunFacts:
    """A short description of a run, as printed by `runs` and `show`.

    Raises:
        UserError: the run's files are broken.
    """
    config = run.config
    path = run.folder.episodes
    episodes = records.decode_jsonl(path, EpisodeRow) if path.is_file() else []
    evaluation = run.evaluation
    return RunFacts(
        name=run.name,
        status=run.status,
        preset=config.preset,
        env_id=config.env_id,
        seed=config.seed,
        config_digest=config.digest,
        episodes=len(episodes),
        env_steps=episodes[-1].env_steps if episodes else 0,
        seconds=episodes[-1].seconds if episodes else 0.0,
        test=evaluation.summary if evaluation else None,
    )


def run_facts(run: Run) -> dict[str, Any]:
    """`describe` as a JSON object.

    Raises:
        UserError: the run's files are broken.
    """
    return describe(run).to_json()


def list_runs(runs_dir: Path | str = DEFAULT_RUNS) -> list[Run]:
    """Every run in a folder, oldest first.

    Raises:
        UserError: there is no such folder.
    """
    if not Path(runs_dir).is_dir():
        raise UserError(f"runs_dir {str(runs_dir)!r}: no such folder; `touchdown train` creates it")
    return [Run(folder) for folder in folders.list_runs(Path(runs_dir))]


def list_facts(runs_dir: Path | str = DEFAULT_RUNS) -> list[dict[str, Any]]:
    """`run_facts` of every run, oldest first; a broken run has its name and the error.

    Raises:
        UserError: there is no such folder.
    """
    facts: list[dict[str, Any]] = []
    for run in list_runs(runs_dir):
        try:
            facts.append(run_facts(run))
        except UserError as error:
            facts.append({"name": run.name, "status": "broken", "error": str(error)})
    return facts
