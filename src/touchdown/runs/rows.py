"""Records in the lines of a run's JSON Lines files."""

from typing import Any

from msgspec import Struct

from touchdown.core.records import Count, Seconds, Share
from touchdown.core.types import Outcome

_STORED = {"env_steps": "observations"}  # names of fields in the files


class EpisodeRow(Struct, frozen=True, kw_only=True, gc=False, rename=_STORED):
    """A line of `episodes.jsonl`: a finished training episode."""

    episode: Count
    """Number of the episode, from 1."""
    env_steps: Count
    """Environment steps so far, including this episode's."""
    episode_return: float
    steps: Count
    outcome: Outcome
    epsilon: Share
    """ε at the end of the episode."""
    seconds: Seconds
    """Seconds of training so far."""


class UpdateRow(Struct, frozen=True, kw_only=True, rename=_STORED):
    """A line of `updates.jsonl`: metrics of one update, which depend on the agent."""

    update: Count
    env_steps: Count
    """So far."""
    metrics: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """As a JSON object with counts and metrics."""
        counts = {"update": self.update, "observations": self.env_steps}
        return {**counts, **self.metrics, **counts}  # no metric replaces a count


class ValidationRow(Struct, frozen=True, kw_only=True, rename=_STORED):
    """A line of `validations.jsonl`: greedy episodes from validation starts."""

    env_steps: Count
    """So far."""
    episode: Count
    """Training episodes so far."""
    mean_return: float
    returns: list[float]
    time_limit_share: Share
