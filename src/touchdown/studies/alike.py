"""How alike two policies fly: a distance between their flights from the same starts (section 9)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from touchdown.core.seeding import TEST_STARTS
from touchdown.core.types import FloatArray
from touchdown.envs import flight as flights
from touchdown.envs.flight import Flight
from touchdown.policies import lookup
from touchdown.policies.named import NamedPolicy
from touchdown.runs import run as runs
from touchdown.runs.folder import RunFolder
from touchdown.studies.results import StudyResults

_METRES = np.array([10.0, 20.0 / 3.0])  # half viewports, across and up


@dataclass(frozen=True, slots=True)
class Likeness:
    """Distances of one agent's flights, each a mean over starts, in metres."""

    seed: int
    to_pid: float
    to_random: float
    to_other_seeds: tuple[float, ...]

    @property
    def ratio(self) -> float:
        """The distance to the PID, of that to another seed of the same agent."""
        return self.to_pid / float(np.mean(self.to_other_seeds))


@dataclass(frozen=True, slots=True)
class Likenesses:
    """Of all seeds of an agent."""

    of: tuple[Likeness, ...]
    starts: int

    def values(self, labels: tuple[str, ...], metric: str) -> FloatArray:
        """Numbers a seed, for claims.

        Args:
            labels: `to the PID`, `to random`, `to another seed`, or the first over the last.
            metric: `distance` in metres, or `ratio`.
        """
        del metric  # the label says which
        kinds = {
            "to the PID": [each.to_pid for each in self.of],
            "to random": [each.to_random for each in self.of],
            "to another seed": [
                float(np.mean(each.to_other_seeds)) for each in self.of if each.to_other_seeds
            ],
            # seeds that all fly alike to the last step have no ratio
            "to the PID, over to another seed": [
                each.ratio for each in self.of if any(each.to_other_seeds)
            ],
        }
        return np.array(kinds[labels[0]], float)


def distance(one: Flight, other: Flight) -> float:
    """Mean distance between two landers at the same moment, in metres.

    Over the steps of the longer flight; the one that is over stays where it ended.
    """
    a, b = (each.observations[:, :2] * _METRES for each in (one, other))
    steps = max(len(a), len(b))
    a, b = (np.pad(each, ((0, steps - len(each)), (0, 0)), mode="edge") for each in (a, b))
    return float(np.hypot(*(a - b).T).mean())


def compare_flights(agents: Mapping[int, NamedPolicy], starts: Sequence[int]) -> Likenesses:
    """Fly agents, the PID and chance from the same starts, and measure between them.

    Args:
        agents: by training seed.
        starts: environment seeds.
    """
    own = {seed: _flown(policy, starts) for seed, policy in agents.items()}
    pid, chance = (_flown(lookup.load(name), starts) for name in ("pid", "random"))
    return Likenesses(
        tuple(
            Likeness(
                seed,
                _between(flown, pid),
                _between(flown, chance),
                tuple(_between(flown, other) for each, other in own.items() if each != seed),
            )
            for seed, flown in own.items()
        ),
        len(starts),
    )


def agents_of(results: StudyResults, labels: tuple[str, ...]) -> dict[int, NamedPolicy]:
    """The chosen policies of a cell's finished runs, by training seed.

    Args:
        results: of the study.
        labels: of the cell.

    Raises:
        UserError: a run's files are broken.
    """
    return {run.seed: runs.load_run(RunFolder(run.path)) for run in results.of(labels)}


def starts_of(count: int) -> range:
    """Test starts: distances are reported, and nothing is chosen by them."""
    return TEST_STARTS[:count]


def _flown(policy: NamedPolicy, starts: Sequence[int]) -> list[Flight]:
    return [
        flights.record_flight(policy.policy, policy.env_id, start, policy.name) for start in starts
    ]


def _between(some: Sequence[Flight], others: Sequence[Flight]) -> float:
    return float(np.mean([distance(a, b) for a, b in zip(some, others, strict=True)]))
