"""An evaluation: a pilot's flights from a set of starts, in numbers, to and from JSON."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gymnasium.envs.registration import registry

from touchdown import files
from touchdown.errors import UserError, one_line
from touchdown.lander import env as lander
from touchdown.runs.evaluate import EpisodeResult, Fleet
from touchdown.runs.pilots import NamedPilot
from touchdown.stats.summary import Interval, Summary, summarise

FORMAT_VERSION = 1


@dataclass(frozen=True, slots=True)
class Evaluation:
    """A pilot's episodes and what they say."""

    name: str
    env_id: str
    episodes: list[EpisodeResult]
    summary: Summary

    def to_json(self) -> dict[str, Any]:
        """As a JSON object."""
        return {
            "name": self.name,
            "env_id": self.env_id,
            "summary": self.summary.to_json(),
            "episodes": [episode.to_json() for episode in self.episodes],
        }


def threshold_of(env_id: str) -> float | None:
    """The return from which Gymnasium calls a world solved; None where it names none."""
    spec = registry.get(env_id)
    threshold = spec.reward_threshold if spec else None
    return None if threshold is None else float(threshold)


def evaluate_pilot(
    pilot: NamedPilot,
    starts: Sequence[int],
    *,
    fleet: Fleet | None = None,
    on_episode: Callable[[], object] = lambda: None,
) -> Evaluation:
    """Fly a pilot greedily, one episode from each start.

    Args:
        pilot: to be judged.
        starts: environment seeds.
        fleet: environments of the pilot's world, if some are at hand.
        on_episode: called after each episode.
    """
    own = fleet or Fleet(pilot.env_id, min(len(starts), 32))
    try:
        episodes = own.fly(pilot.pilot, starts, on_episode)
    finally:
        if fleet is None:
            own.close()
    return Evaluation(pilot.name, pilot.env_id, episodes, _summary_of(pilot.env_id, episodes))


def _summary_of(env_id: str, episodes: Sequence[EpisodeResult]) -> Summary:
    return summarise(
        [episode.episode_return for episode in episodes],
        [episode.steps for episode in episodes],
        [episode.outcome for episode in episodes],
        [episode.fuel for episode in episodes],
        threshold_of(env_id),
    )


def write_evaluations(
    path: Path, evaluations: Sequence[Evaluation], chosen: dict[str, Any]
) -> None:
    """Write a run's test flights: its own first, then the baselines'.

    Args:
        path: of `evaluation.json`.
        evaluations: of every pilot, all from the same starts.
        chosen: facts about the checkpoint that was flown.
    """
    content = {
        "format_version": FORMAT_VERSION,
        "checkpoint": chosen,
        "pilots": [evaluation.to_json() for evaluation in evaluations],
    }
    files.write_atomic(path, files.to_json(content))


def read_evaluations(path: Path) -> list[Evaluation]:
    """What `write_evaluations` wrote.

    Raises:
        UserError: the file is broken or of another version.
    """
    content = files.read_json(path)
    if content.get("format_version") != FORMAT_VERSION:
        raise UserError(
            f"{path}: format_version = {content.get('format_version')!r}: "
            f"this touchdown reads {FORMAT_VERSION}"
        )
    try:
        return [_evaluation_from(entry) for entry in content["pilots"]]
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: not an evaluation: {one_line(error)}") from None


def _evaluation_from(entry: dict[str, Any]) -> Evaluation:
    episodes = [EpisodeResult(**episode) for episode in entry["episodes"]]
    numbers = dict(entry["summary"])
    numbers["iqm"] = Interval(**numbers["iqm"])
    return Evaluation(entry["name"], entry["env_id"], episodes, Summary(**numbers))


def median_start(evaluation: Evaluation) -> int:
    """The start of the episode with the median return: neither the luckiest nor the worst."""
    ranked = sorted(evaluation.episodes, key=lambda episode: episode.episode_return)
    return ranked[len(ranked) // 2].seed


def is_lander(evaluation: Evaluation) -> bool:
    """Whether the flights were the lander's."""
    return lander.is_lander(evaluation.env_id)
