"""The paper's topics: the question of each, and its number of runs."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from touchdown.core.errors import UserError
from touchdown.core.names import hint
from touchdown.studies import paper
from touchdown.studies.paper import SCALES


@dataclass(frozen=True, slots=True)
class TopicListing:
    """One of the paper's topics."""

    name: str
    section: str
    question: str
    cells: int
    seeds: int
    claims: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As values for JSON."""
        return dataclasses.asdict(self)


def list_studies(scale: str = "quick") -> list[TopicListing]:
    """The paper's topics at a scale.

    Raises:
        UserError: there is no such scale.
    """
    if scale not in SCALES:
        raise UserError(f"scale = {scale!r}: {hint(scale, SCALES)}")
    found: list[TopicListing] = []
    for topic in paper.topics(scale).values():
        tunings = paper.pid_jobs(scale)
        seeds = len({job.tuning.seed for job in tunings})
        cells = len(tunings) // seeds
        if topic.study is not None:
            cells, seeds = len(topic.study.cells()), topic.study.seeds
        claims = tuple(claim.sentence for claim in topic.claims)
        found.append(TopicListing(topic.name, topic.section, topic.question, cells, seeds, claims))
    return found
