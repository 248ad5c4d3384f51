"""An evaluation: results of a policy's episodes from a set of starts, to and from JSON."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from touchdown.core import files, notebook, records
from touchdown.envs.custom import threshold_of
from touchdown.evaluation.evaluator import NUM_ENVS, EpisodeResult, Evaluator, Observer
from touchdown.evaluation.rows import points, summary_rows
from touchdown.lander import rules
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.named import NamedPolicy
from touchdown.stats.summary import Summary, summarise

FORMAT_VERSION = 1


@dataclass(frozen=True, slots=True)
class Evaluation:
    """A policy's episodes and their summary."""

    name: str
    env_id: str
    episodes: Annotated[list[EpisodeResult], Meta(min_length=1)]
    summary: Summary

    def to_json(self) -> dict[str, Any]:
        """As a JSON object."""
        return {
            "name": self.name,
            "env_id": self.env_id,
            "summary": self.summary.to_json(),
            "episodes": [episode.to_json() for episode in self.episodes],
        }

    def __repr__(self) -> str:
        summary = self.summary
        mean, sd = points(summary.mean_return, 1), points(summary.sd_return, 0)
        text = f"{self.name}: {self.env_id}, return {mean} ± {sd} (n={len(self.episodes)})"
        if summary.share_solved is not None:
            text += f", {summary.share_solved:.0%} ≥ {summary.threshold:g}"
        return f"<Evaluation {notebook.plain(text)}>"

    def _repr_html_(self) -> str:
        """The table, for a notebook."""
        first, last = self.episodes[0].seed, self.episodes[-1].seed
        count = len(self.episodes)
        line = f"{self.env_id}, {count} greedy episodes from starts {first}-{last}"
        rows = summary_rows(self.env_id, self.summary.threshold)
        cells = [(name.strip(), cell(self.summary)) for name, cell in rows]
        return notebook.facts_html(self.name, line, cells)


class _EvaluationFile(Struct, frozen=True, rename={"evaluations": "pilots"}):
    """`evaluation.json`."""

    format_version: Literal[1]
    checkpoint: WeightsFacts
    """Facts about the tested weights."""
    evaluations: Annotated[list[Evaluation], Meta(min_length=1)]

    def __post_init__(self) -> None:
        thresholds = {evaluation.summary.threshold for evaluation in self.evaluations}
        if len(thresholds) > 1:
            raise ValueError("pilots: must all have the same summary.threshold")
        for index, evaluation in enumerate(self.evaluations):
            summary = evaluation.summary
            if (summary.share_solved is None) != (summary.threshold is None):
                raise ValueError(
                    f"pilots[{index}].summary.share_solved = {summary.share_solved}: "
                    "must be a number if there is a threshold, else null"
                )


def evaluate_policy(
    policy: NamedPolicy,
    starts: Sequence[int],
    *,
    evaluator: Evaluator | None = None,
    on_episode: Callable[[], object] = lambda: None,
    observer: Observer | None = None,
) -> Evaluation:
    """Run one greedy episode of a policy from each start.

    Args:
        policy: the policy to evaluate.
        starts: environment seeds.
        evaluator: an evaluator for the policy's environment; None makes a new one.
        on_episode: called after each episode.
        observer: called with each observation; see `Evaluator.rollout`.

    Raises:
        UserError: the policy's environment cannot be made.
        ValueError: there are no starts.
    """
    own = evaluator or Evaluator(policy.env_id, min(len(starts), NUM_ENVS))
    try:
        episodes = own.rollout(policy.policy, starts, on_episode, observer)
    finally:
        if evaluator is None:
            own.close()
    return summarised(policy, episodes)


def summarised(policy: NamedPolicy, episodes: list[EpisodeResult]) -> Evaluation:
    """The evaluation of a policy with these episodes, at least one."""
    return Evaluation(policy.name, policy.env_id, episodes, _summary_of(policy.env_id, episodes))


def _summary_of(env_id: str, episodes: Sequence[EpisodeResult]) -> Summary:
    return summarise(
        [episode.episode_return for episode in episodes],
        [episode.steps for episode in episodes],
        [episode.outcome for episode in episodes],
        [episode.fuel for episode in episodes],
        threshold_of(env_id),
    )


def write_evaluations(path: Path, evaluations: Sequence[Evaluation], chosen: WeightsFacts) -> None:
    """Write a run's test episodes: its own policy's first, then the baselines'.

    Args:
        path: path of `evaluation.json`.
        evaluations: evaluations of all policies, from the same starts.
        chosen: facts about the tested weights.
    """
    content = {
        "format_version": FORMAT_VERSION,
        "checkpoint": chosen,
        "pilots": [evaluation.to_json() for evaluation in evaluations],
    }
    files.write_atomic(path, files.to_json(content), follow=False)


def read_evaluations(path: Path) -> list[Evaluation]:
    """The evaluations that `write_evaluations` wrote, at least one.

    Raises:
        UserError: the file is missing, broken or of another version.
    """
    return records.decode_json(path, _EvaluationFile, FORMAT_VERSION).evaluations


def median_start(evaluation: Evaluation) -> int:
    """The start of the episode with the median return."""
    ranked = sorted(evaluation.episodes, key=lambda episode: episode.episode_return)
    return ranked[len(ranked) // 2].seed


def is_lander(evaluation: Evaluation) -> bool:
    """Whether the environment is the lander."""
    return rules.is_lander(evaluation.env_id)
