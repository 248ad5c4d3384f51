"""Similarity of two policies' flights: distances of paths from the same starts (section 9)."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from touchdown.core.types import FloatArray
from touchdown.evaluation.paths import FlightPath, FlightPaths, load_paths
from touchdown.runs.folder import RunFolder
from touchdown.studies.results import StudyResults
from touchdown.studies.store import Store
from touchdown.studies.work import BaselineJob

_METRES = np.array([10.0, 20.0 / 3.0])  # half viewports, horizontally and vertically


@dataclass(frozen=True, slots=True)
class SeedDistances:
    """Distances of one training seed's flights in metres: means over starts."""

    seed: int
    to_pid: float
    to_random: float
    to_other_seeds: Mapping[int, float]
    """By the other seed."""

    @property
    def to_another(self) -> float:
        """The mean distance to another seed of the same agent; NaN without one."""
        return float(np.mean([*self.to_other_seeds.values()])) if self.to_other_seeds else math.nan

    @property
    def ratio(self) -> float:
        """The distance to the PID divided by that to another seed of the same agent."""
        return self.to_pid / self.to_another


@dataclass(frozen=True, slots=True)
class Controls:
    """Distances to the PID's flights of others than the agent in question, in metres."""

    agents: Mapping[str, Mapping[int, float]]
    """Of other agents, by name and training seed."""
    heuristic: float
    """Of Gymnasium's heuristic; NaN if its flights are not recorded."""


@dataclass(frozen=True, slots=True)
class AgentDistances:
    """The distances of all seeds of an agent."""

    of: tuple[SeedDistances, ...]
    starts: int

    def until(self, end: int) -> "AgentDistances":
        """The same without the seeds from `end` on."""
        return AgentDistances(
            tuple(
                replace(
                    each,
                    to_other_seeds={s: d for s, d in each.to_other_seeds.items() if s < end},
                )
                for each in self.of
                if each.seed < end
            ),
            self.starts,
        )

    def values(self, name: str, metric: str) -> FloatArray:
        """One number per seed, for claims.

        Args:
            name: `to the PID`, `to random`, `to another seed`, or the ratio of first to last.
            metric: `distance` in metres, or `ratio`.
        """
        del metric  # the name says which
        kinds = {
            "to the PID": [each.to_pid for each in self.of],
            "to random": [each.to_random for each in self.of],
            "to another seed": [each.to_another for each in self.of if each.to_other_seeds],
            # no ratio if all flights of the seeds are equal
            "to the PID, over to another seed": [
                each.ratio for each in self.of if any(each.to_other_seeds.values())
            ],
        }
        return np.array(kinds[name], float)


def distance(one: FlightPath, other: FlightPath) -> float:
    """Mean distance between two landers at the same step, in metres.

    The mean is over the steps of the longer flight; after the shorter one ends, its lander stays at
    the last position.
    """
    short, long = sorted((one * _METRES, other * _METRES), key=len)
    both = np.hypot(*(long[: len(short)] - short).T).sum()
    rest = np.hypot(*(long[len(short) :] - short[-1]).T).sum()
    return float(both + rest) / len(long)


def compare_paths(
    agents: Mapping[int, FlightPaths], pid: FlightPaths, random: FlightPaths
) -> AgentDistances:
    """Measure distances between flights of agents, the PID and random actions from equal starts.

    Args:
        agents: paths by training seed, at least one.
        pid: paths of the PID.
        random: paths of random actions.
    """
    known = [pid, random, *agents.values()]
    starts = [start for start in pid if all(start in paths for paths in known)]

    def between(some: FlightPaths, others: FlightPaths) -> float:
        return float(np.mean([distance(some[start], others[start]) for start in starts]))

    to_others: dict[int, dict[int, float]] = {seed: {} for seed in agents}
    for one, other in itertools.combinations(agents, 2):  # many: a hundred seeds have 5,000 pairs
        to_others[one][other] = to_others[other][one] = between(agents[one], agents[other])
    return AgentDistances(
        tuple(
            SeedDistances(seed, between(paths, pid), between(paths, random), to_others[seed])
            for seed, paths in agents.items()
        ),
        len(starts),
    )


def agent_distances(
    results: StudyResults, labels: tuple[str, ...], store: Store
) -> AgentDistances | None:
    """The distances of a cell's finished runs, from recorded paths.

    Args:
        results: results of the study.
        labels: the cell's labels.
        store: the store with the baselines' paths.

    Returns:
        The distances; None if no run of the cell, or no baseline, has recorded paths.

    Raises:
        UserError: a file of paths is broken.
    """
    agents = {run.seed: _paths_of(run.path) for run in results.of(labels)}
    known = {seed: paths for seed, paths in agents.items() if paths}
    pid, random = (_paths_of(store.runs / BaselineJob(name).digest) for name in ("pid", "random"))
    if not known or pid is None or random is None:
        return None
    return compare_paths(known, pid, random)


def controls(results: StudyResults, agent: str, store: Store) -> Controls:
    """How near to the PID's flights those of others are.

    Args:
        results: results of a study of agents.
        agent: the cell that the controls are compared with; left out.
        store: the store with the baselines' paths.

    Raises:
        UserError: a file of paths is broken.
    """
    pid, heuristic = (
        _paths_of(store.runs / BaselineJob(name).digest) for name in ("pid", "heuristic")
    )
    if pid is None:
        return Controls({}, math.nan)
    agents = {
        cell.name: {
            run.seed: _between(paths, pid)
            for run in results.of(cell.labels)
            if (paths := _paths_of(run.path)) is not None
        }
        for cell in results.study.cells()
        if cell.name != agent
    }
    known = {name: of for name, of in agents.items() if of}
    return Controls(known, math.nan if heuristic is None else _between(heuristic, pid))


def _between(some: FlightPaths, others: FlightPaths) -> float:
    """Mean distance over the starts that both have."""
    starts = [start for start in some if start in others]
    return float(np.mean([distance(some[start], others[start]) for start in starts]))


def _paths_of(folder: Path) -> FlightPaths | None:
    path = RunFolder(folder).paths
    return load_paths(path) if path.is_file() else None
