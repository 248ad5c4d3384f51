"""Readings of the paper: other choices for what it leaves open, each with all its experiments.

Of the 24 combinations, half are run, by a fractional design (Box & Hunter, 1961): those in which an
even number of the last three choices is not the shipped one. Every pair of choices on two axes
occurs equally often, so that the effects of the axes can be told apart. The effect of one of the
last three cannot be told from what the other two of them do only together.
"""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from touchdown.studies.changes import Changes
from touchdown.studies.paper.experiments import Topic, topics
from touchdown.studies.paper.levels import Scale
from touchdown.studies.plan import Study

SHIPPED = "shipped"
LEARNER, TIME_LIMIT, LENGTH, POSITIVE = "learner", "time limit", "length", "positive reward"
AXES: Mapping[str, Mapping[str, str]] = {
    LEARNER: {
        SHIPPED: "the settings of this project's presets",
        "literal-1e-3": "only what the paper says, with a learning rate of 1e-3",
        "literal-2.5e-4": "only what the paper says, with a learning rate of 2.5e-4",
    },
    TIME_LIMIT: {
        "bootstraps": "after its last step, the TD target bootstraps",
        "ends": "it ends the episode",
    },
    LENGTH: {
        "steps": "training ends after the scale's environment steps",
        "episodes": "training ends after 300 episodes",
    },
    POSITIVE: {
        "above-99": "only the reward of a landing is positive: above 99",
        "above-0": "every reward above 0 is positive",
    },
}
"""What the paper leaves open: the choices by axis, each with its meaning. The first is the shipped
one."""
ABOUT_REWARDS = ("ladder", "size", "depth", "target-period", "resaves")
"""The studies of sections 7 to 8.3, in which the positive reward is varied."""
_OF_FINAL_WEIGHTS = {"best_return": "last_return", "share_solved": "last_share_solved"}
_EPISODES = 300
_RATES = {"literal-1e-3": 1e-3, "literal-2.5e-4": 2.5e-4}


@dataclass(frozen=True, slots=True)
class Reading:
    """One choice on every axis."""

    choices: tuple[str, ...]
    """In the order of `AXES`."""

    @property
    def name(self) -> str:
        """The choices in one word, as in the names of its studies."""
        return ".".join(self.choices)

    @property
    def by_axis(self) -> dict[str, str]:
        """The choices by axis."""
        return dict(zip(AXES, self.choices, strict=True))

    @property
    def is_shipped(self) -> bool:
        """Whether it is the one of the paper's studies."""
        return self == _SHIPPED_READING

    @property
    def is_preset(self) -> bool:
        """Whether it learns with the settings of the presets, rather than literally."""
        return self.by_axis[LEARNER] == SHIPPED

    def metric_of(self, metric: str) -> str:
        """What a claim about a metric compares: literally read, the paper tests the final weights.

        Args:
            metric: the metric in the shipped reading.
        """
        return metric if self.is_preset else _OF_FINAL_WEIGHTS.get(metric, metric)

    def study_of(self, study: Study) -> Study:
        """A study in this reading; the shipped reading is the study itself, by another name."""
        changes = self._changes(with_rewards=study.name in ABOUT_REWARDS)
        merged = _merged(study.changes, changes)
        return replace(study, name=self.name_of(study.name), changes=merged, looks=())

    def name_of(self, study: str) -> str:
        """The name of a study in this reading."""
        return f"{study}.{self.name}"

    def _changes(self, *, with_rewards: bool) -> Changes:
        chosen = self.by_axis
        changes: dict[str, Any] = {}
        if chosen[LEARNER] in _RATES:
            changes["learning"] = {
                "loss": "mse",
                "max_grad_norm": 0.0,
                "reward_scale": 1.0,
                "learning_rate": _RATES[chosen[LEARNER]],
                "learning_rate_end": 0.0,
                "learning_rate_duration": 0,
            }
            changes["exploration"] = {"epsilon_end": 0.01}
        if chosen[TIME_LIMIT] == "ends":
            changes = _merged(changes, {"learning": {"bootstrap_on_time_limit": False}})
        if chosen[LENGTH] == "episodes":
            # no more steps than that many episodes of the longest kind
            changes["training"] = {"episodes": _EPISODES, "max_env_steps": 1_000 * _EPISODES}
        if chosen[POSITIVE] == "above-0" and with_rewards:
            changes["replay"] = {"resave_threshold": 0.0}
        return changes


_SHIPPED_READING = Reading(tuple(next(iter(choices)) for choices in AXES.values()))


def readings() -> list[Reading]:
    """The readings of the design; the shipped one is the first."""
    return [
        Reading(choices)
        for choices in itertools.product(*AXES.values())
        if sum(a != b for a, b in zip(choices[1:], _SHIPPED_READING.choices[1:], strict=True)) % 2
        == 0
    ]


def reading_topics(scale: Scale) -> list[Topic]:
    """The paper's topics that other readings concern: those with claims about training runs."""
    # flights are compared with the PID's in the shipped reading alone, for want of other records;
    # the combination of section 9 needs many levels that no other claim needs
    return [
        topic
        for topic in topics(scale).values()
        if topic.study is not None and topic.claims and topic.name not in ("alike", "combination")
    ]


@cache  # checking the settings of some hundred cells takes seconds
def reading_studies(scale: Scale) -> dict[Reading, list[Study]]:
    """The studies of each reading, each study once."""
    studies = {topic.study.name: topic.study for topic in reading_topics(scale) if topic.study}
    return {
        reading: [reading.study_of(study) for study in studies.values()] for reading in readings()
    }


def _merged(first: Changes, second: Changes) -> dict[str, Any]:
    """Changes by section, of which the second ones take precedence."""
    return {
        section: {**first.get(section, {}), **second.get(section, {})}
        for section in dict.fromkeys((*first, *second))
    }
