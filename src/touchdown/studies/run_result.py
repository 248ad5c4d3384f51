"""The numbers of a finished run, read from its folder."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from touchdown.core import records
from touchdown.core.errors import UserError
from touchdown.envs.custom import threshold_of
from touchdown.evaluation.evaluation import Evaluation, read_evaluations
from touchdown.lander import rules
from touchdown.policies import weights as policy_weights
from touchdown.runs.folder import RunFolder
from touchdown.runs.provenance import Provenance
from touchdown.runs.rows import EpisodeRow, ValidationRow
from touchdown.stats import curves
from touchdown.stats.summary import Summary
from touchdown.studies import value_error
from touchdown.studies.run_lines import Curve, Origin, TrainingParts, parts_of
from touchdown.studies.work import LAST

_LAST_EPISODES = 100
_WINDOW = 100  # training episodes in a row


@dataclass(frozen=True, slots=True)
class RunResult:
    """The numbers of a finished run."""

    path: Path
    """Its folder."""
    labels: tuple[str, ...]
    seed: int
    best_return: float
    last_return: float
    """Like `best_return`, `worst_return`, `share_solved` and `landed`, NaN if there was no test."""
    validation_return: float
    last_validation: float
    """Validation return of the final weights, on as many starts as in each validation."""
    early_return: float
    area: float
    training_return: float
    """Mean return of the last `_LAST_EPISODES` training episodes; those explore."""
    hover_share: float
    hover_step_share: float
    hover_peak_share: float
    worst_return: float
    share_solved: float
    """Share of test returns that reach the threshold; NaN also in an environment without one."""
    last_share_solved: float
    """The same of the final weights."""
    overestimation: float
    """NaN if no values were recorded, as in runs of earlier versions and of agents without any."""
    rewarded_share: float
    """Of the last recorded update; NaN without a replay memory."""
    landed: float
    """NaN also in environments other than the lander."""
    env_steps: int
    seconds: float
    """Seconds of training, up to the decision to stop if the run stops when solved."""
    env_steps_to_solved: float
    """Environment steps before a validation first reached the threshold; ∞ if none did."""
    seconds_to_solved: float
    test: Summary | None
    """Summary of the selected checkpoint's test flights; None if there was no test."""
    validations: Curve
    """Environment steps and mean returns of the validations."""
    origin: Origin
    """What made it."""
    parts: TrainingParts
    """Its training episodes, summarised over equal parts of training."""

    @property
    def name(self) -> str:
        """Name of its folder; for a study's runs, their digest."""
        return self.path.name

    @property
    def is_tested(self) -> bool:
        """Whether its config includes a test."""
        return self.test is not None

    @property
    def return_of_last(self) -> float:
        """Mean return of the final weights on test starts or, without a test, validation starts."""
        return self.last_return if self.is_tested else self.last_validation

    @property
    def hovering(self) -> Curve:
        """Environment steps, and the share of the episodes that reached the time limit."""
        return self.parts.ends, self.parts.hovering

    @property
    def training_returns(self) -> Curve:
        """Environment steps, and the mean return of the training episodes."""
        return self.parts.ends, self.parts.returns

    @property
    def training_steps(self) -> Curve:
        """Environment steps, and the mean number of steps of the training episodes."""
        return self.parts.ends, self.parts.steps

    @property
    def folder(self) -> RunFolder:
        """Its files."""
        return RunFolder(self.path)


def read_run(path: Path, labels: tuple[str, ...], seed: int) -> RunResult:
    """The numbers of a finished run.

    Args:
        path: the run's folder.
        labels: its cell's labels.
        seed: its training seed.

    Raises:
        UserError: its files are broken.
    """
    folder = RunFolder(path)
    chosen, last = _test_of(folder)
    episodes = records.decode_jsonl(folder.episodes, EpisodeRow)
    validations = records.decode_jsonl(folder.validations, ValidationRow)
    if not episodes or not episodes[-1].env_steps:
        raise UserError(f"{folder.episodes}: has no steps, but its run is finished")
    if not validations:
        raise UserError(f"{folder.validations}: is empty, but its run is finished")
    at = [float(row.env_steps) for row in validations]
    means = [row.mean_return for row in validations]
    ends = np.array([row.env_steps for row in episodes], float)
    timed_out = [row.outcome == "timed out" for row in episodes]
    # as recorded: the module of a user's environment may not be importable any more
    threshold = chosen.summary.threshold if chosen else threshold_of(folder.config().env_id)
    solved = math.inf if threshold is None else curves.first_reaching(at, means, threshold)
    until = float(ends[-1])
    seconds = [row.seconds for row in episodes]
    facts = policy_weights.facts_of(folder.best)
    if facts.final_validation_return is None:
        raise UserError(f"{folder.best}: has no final_validation_return")
    lands = chosen is not None and rules.is_lander(chosen.env_id)
    return RunResult(
        path=path,
        labels=labels,
        seed=seed,
        best_return=chosen.summary.mean_return if chosen else math.nan,
        last_return=last.summary.mean_return if last else math.nan,
        validation_return=facts.final_validation_return,
        last_validation=means[-1],
        early_return=curves.area_under(at, means, until / 3),
        area=curves.area_under(at, means, until),
        training_return=float(np.mean([row.episode_return for row in episodes[-_LAST_EPISODES:]])),
        hover_share=float(np.mean(timed_out)),
        hover_step_share=float(np.average(timed_out, weights=[row.steps for row in episodes])),
        hover_peak_share=_peak(timed_out),
        worst_return=min(e.episode_return for e in chosen.episodes) if chosen else math.nan,
        share_solved=_share_solved(chosen),
        last_share_solved=_share_solved(last),
        overestimation=value_error.read_overestimation(path),
        rewarded_share=_rewarded_share(folder),
        landed=chosen.summary.outcomes.get("landed", 0.0) if chosen and lands else math.nan,
        env_steps=int(until),
        seconds=seconds[-1] if facts.solved_seconds is None else facts.solved_seconds,
        env_steps_to_solved=solved,
        seconds_to_solved=solved if math.isinf(solved) else float(np.interp(solved, ends, seconds)),
        test=chosen.summary if chosen else None,
        validations=(tuple(at), tuple(means)),
        origin=_origin_of(folder),
        parts=parts_of(episodes),
    )


def _test_of(folder: RunFolder) -> tuple[Evaluation | None, Evaluation | None]:
    """The test of the selected checkpoint and of the final weights; None without a test.

    Raises:
        UserError: a file is broken, or the evaluation of a run with a test is missing.
    """
    if not folder.evaluation.is_file():
        if folder.config().training.test_episodes:
            raise UserError(
                f"{folder.evaluation}: missing from a finished run; restore it from a copy, or "
                f"delete {folder.path} to train the run again"
            )
        return None, None
    chosen = read_evaluations(folder.evaluation)[0]
    last = folder.path / LAST
    return chosen, read_evaluations(last)[0] if last.is_file() else chosen


def _share_solved(tested: Evaluation | None) -> float:
    """NaN without a test, or in an environment without a threshold."""
    share = tested.summary.share_solved if tested else None
    return math.nan if share is None else share


def _rewarded_share(folder: RunFolder) -> float:
    """Of the replay memory at the last recorded update; NaN without one."""
    if not folder.updates.is_file():  # training ended before the first one
        return math.nan
    updates = records.decode_jsonl(folder.updates, dict[str, float])
    return updates[-1].get("rewarded_share", math.nan) if updates else math.nan


def _origin_of(folder: RunFolder) -> Origin:
    if not folder.provenance.is_file():
        return Origin()
    made = records.decode_json(folder.provenance, Provenance)
    return Origin(git_commit=made.git_commit, cpu=made.cpu, simd=made.simd)


def _peak(timed_out: Sequence[bool]) -> float:
    """The largest share in any `_WINDOW` episodes in a row; of all, if there are fewer."""
    counts = np.concatenate([[0], np.cumsum(timed_out)])
    width = min(_WINDOW, len(timed_out))
    return float((counts[width:] - counts[:-width]).max()) / width
