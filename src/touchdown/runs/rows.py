"""The lines of a run's JSON Lines files, as they are written and read."""

from typing import Any

from msgspec import Struct

from touchdown.core.records import Count, Seconds, Share
from touchdown.core.types import Outcome

_STORED = {"env_steps": "observations"}  # what fields are called in the files


class EpisodeRow(Struct, frozen=True, kw_only=True, gc=False, rename=_STORED):
    """A line of `episodes.jsonl`: a training episode that has ended."""

    episode: Count
    """Its number, from 1."""
    env_steps: Count
    """So far, this episode's included."""
    episode_return: float
    steps: Count
    outcome: Outcome
    epsilon: Share
    """At its end."""
    seconds: Seconds
    """Of training so far."""


class UpdateRow(Struct, frozen=True, kw_only=True, rename=_STORED):
    """A line of `updates.jsonl`: one update of many, in numbers that depend on the agent."""

    update: Count
    env_steps: Count
    """So far."""
    metrics: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """As a JSON object, the metrics beside the counts."""
        counts = {"update": self.update, "observations": self.env_steps}
        return {**counts, **self.metrics, **counts}  # no metric replaces a count


class ValidationRow(Struct, frozen=True, kw_only=True, rename=_STORED):
    """A line of `validations.jsonl`: greedy episodes from the validation starts."""

    env_steps: Count
    """So far."""
    episode: Count
    """Training episodes so far."""
    mean_return: float
    returns: list[float]
    time_limit_share: Share
