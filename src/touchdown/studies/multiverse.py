"""The paper's claims in every reading: where they hold, and which choice turns them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchdown.studies.claims import Claim, Decision, decide
from touchdown.studies.metrics import DEFAULT_METRIC
from touchdown.studies.paper import BEST, Scale, Topic
from touchdown.studies.paper.readings import (
    ABOUT_REWARDS,
    AXES,
    POSITIVE,
    Reading,
    reading_topics,
    readings,
)
from touchdown.studies.results import StudyResults

PAPER_RETURNS: Mapping[str, float] = {"target-dqn": 170.0, "preferential-dqn": 199.0, BEST: 221.0}
"""The paper's own returns, by the level of the study `ladder`."""
_HOLD = ("holds", "reached and exceeded")


@dataclass(frozen=True, slots=True)
class Turn:
    """How often a claim holds by the choices on one axis."""

    axis: str
    shares: Mapping[str, float]
    """Of the readings with runs, by choice."""

    @property
    def spread(self) -> float:
        """The largest share minus the smallest; 0 with fewer than two choices."""
        return max(self.shares.values(), default=0.0) - min(self.shares.values(), default=0.0)


@dataclass(frozen=True, slots=True)
class ReadClaim:
    """One claim in every reading that has runs."""

    topic: Topic
    claim: Claim
    decisions: Mapping[Reading, Decision]

    @property
    def share(self) -> float:
        """Share of the readings with runs in which it holds; NaN without any."""
        return _share(list(self.decisions.values()))

    @property
    def turns(self) -> list[Turn]:
        """How often it holds by each axis that its study varies, the largest spread first."""
        study = self.topic.study
        varies_rewards = study is not None and study.name in ABOUT_REWARDS
        found: list[Turn] = []
        for place, (axis, choices) in enumerate(AXES.items()):
            if axis == POSITIVE and not varies_rewards:
                continue
            by_choice = {
                choice: [d for r, d in self.decisions.items() if r.choices[place] == choice]
                for choice in choices
            }
            shares = {choice: _share(of) for choice, of in by_choice.items() if of}
            found.append(Turn(axis, shares))
        return sorted(found, key=lambda turn: -turn.spread)


@dataclass(frozen=True, slots=True)
class PaperDistance:
    """How far a reading is from the paper's own returns."""

    reading: Reading
    medians: Mapping[str, float]
    """Of the seeds, by the level of `ladder`, for each of the paper's returns."""

    @property
    def points(self) -> float:
        """Mean distance from the paper's returns."""
        return float(np.mean([abs(self.medians[k] - v) for k, v in PAPER_RETURNS.items()]))


def read_claims(
    scale: Scale, results: Mapping[str, StudyResults], on_reading: Callable[[str], object]
) -> list[ReadClaim]:
    """Decide every claim in every reading that has runs.

    Args:
        scale: scale of the runs.
        results: results by the name of a reading's study.
        on_reading: called after each reading with its name.
    """
    topics = reading_topics(scale)
    found: dict[tuple[str, str], dict[Reading, Decision]] = {
        (topic.name, claim.sentence): {} for topic in topics for claim in topic.claims
    }
    for reading in readings():
        for topic in topics:
            for decision in _decisions(topic, reading, results):
                found[topic.name, decision.claim.sentence][reading] = decision
        on_reading(reading.name)
    return [
        ReadClaim(topic, claim, found[topic.name, claim.sentence])
        for topic in topics
        for claim in topic.claims
    ]


def paper_distances(results: Mapping[str, StudyResults]) -> list[PaperDistance]:
    """The readings whose runs have all of the paper's levels, the nearest to its returns first."""
    found: list[PaperDistance] = []
    for reading in readings():
        of = results.get(reading.name_of("ladder"))
        metric = reading.metric_of(DEFAULT_METRIC)
        values = {} if of is None else {k: of.named(k, metric) for k in PAPER_RETURNS}
        known = {level: each[~np.isnan(each)] for level, each in values.items()}
        if known and all(map(len, known.values())):
            medians = {level: float(np.median(each)) for level, each in known.items()}
            found.append(PaperDistance(reading, medians))
    return sorted(found, key=lambda each: each.points)


def _decisions(
    topic: Topic, reading: Reading, results: Mapping[str, StudyResults]
) -> list[Decision]:
    if topic.study is None:
        return []
    found = results.get(reading.name_of(topic.study.name))
    if found is None or not found.runs:
        return []
    claims = [replace(each, metric=reading.metric_of(each.metric)) for each in topic.claims]
    decisions = decide(claims, found.named, reading.metric_of(topic.metric), with_advice=False)
    return [each for each in decisions if each.seeds]  # the others have no runs yet


def _share(decisions: Sequence[Decision]) -> float:
    if not decisions:
        return float("nan")
    return sum(each.verdict in _HOLD for each in decisions) / len(decisions)
