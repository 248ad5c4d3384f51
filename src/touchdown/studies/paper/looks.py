"""The paper's claims, decided in looks. All claims of the page share one error rate of 5%."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from touchdown.core.types import FloatArray
from touchdown.studies import alike, claims, looks
from touchdown.studies.claims import Decision
from touchdown.studies.findings import Values
from touchdown.studies.job import Job
from touchdown.studies.looks import LookDecision, Question, SeedValues
from touchdown.studies.paper.experiments import Topic, pid_jobs, topics
from touchdown.studies.paper.levels import BEST, FIRST_SEED, LADDER_SEEDS, LOOKS, SPENDING, Scale
from touchdown.studies.pid_results import PidResult, read_pid
from touchdown.studies.plan import FIRST_TUNING_SEED
from touchdown.studies.results import StudyResults, read_study
from touchdown.studies.run_result import RunResult
from touchdown.studies.store import Store
from touchdown.studies.work import PidJob, TrainJob


@dataclass(frozen=True, slots=True)
class PaperResults:
    """All results of the paper's topics so far, and the decisions on its claims."""

    scale: Scale
    results: Mapping[str, StudyResults]
    """By the study's name; missing are the runs that open claims need next."""
    tuned: Sequence[PidResult]
    distances: alike.AgentDistances | None
    """Between flights of the best agent; None without recorded paths."""
    decisions: Mapping[str, Sequence[Decision]]
    """By the topic's name."""
    seeds_needed: Mapping[str, Mapping[str, int]]
    """Seeds that each cell should have now, by the study's name; `pid` has those of each tuner.
    Empty for a preview."""

    def next_jobs(self, topic: Topic) -> list[Job]:
        """The jobs that a topic's open claims need now, done or not, by seed."""
        if topic.study is None:
            return list(_pid_jobs(self.scale, self.seeds_needed[topic.name]))
        planned = looks.planned_until(topic.study, self.seeds_needed[topic.study.name])
        if topic.name == "alike":
            return [TrainJob(r.config, needs_flights=True) for r in planned if r.cell.name == BEST]
        return [TrainJob(run.config) for run in planned]


def preview_paper(
    scale: Scale, seeds: int | None, store: Store, chosen: Sequence[Topic]
) -> PaperResults:
    """Read topics of a scale without looks; their claims have evidence, but no verdict.

    Args:
        scale: the scale.
        seeds: training seeds per cell; None uses the studies' own numbers.
        store: store of the runs.
        chosen: the topics.

    Raises:
        UserError: a finished run's files are broken.
    """
    studies = {topic.study.name: topic.study for topic in chosen if topic.study}
    known: dict[str, RunResult] = {}
    results = {
        name: read_study(study, seeds or study.seeds, store, known)
        for name, study in studies.items()
    }
    tuned = read_pid(pid_jobs(scale, seeds), store)
    distances = None
    if "ladder" in results:
        distances = alike.agent_distances(results["ladder"], (BEST,), store)
    decisions: dict[str, list[Decision]] = {}
    for topic in chosen:
        values = _values_of(topic, results, tuned, distances, FIRST_SEED[scale])
        decisions[topic.name] = claims.preview(topic.claims, _of_all(values), topic.metric)
    return PaperResults(scale, results, tuned, distances, decisions, {})


def _of_all(values: SeedValues) -> Values:
    return lambda cell, metric: values(cell, metric, FIRST_TUNING_SEED)


def read_paper(scale: Scale, store: Store) -> PaperResults:
    """Read all topics and decide what can be.

    Args:
        scale: a scale with looks.
        store: store of the runs.

    Raises:
        UserError: a finished run's files are broken.
    """
    first, *others = LOOKS[scale]
    known: dict[str, RunResult] = {}
    found = _read_until(scale, store, first, known)
    for most in others:  # most later seeds are never run; looking for all of them would be slow
        if max(seeds for cells in found.seeds_needed.values() for seeds in cells.values()) < most:
            break
        found = _read_until(scale, store, most, known)
    return found


def _read_until(scale: Scale, store: Store, most: int, known: dict[str, RunResult]) -> PaperResults:
    """Like `read_paper`, with the first seeds alone."""
    of = topics(scale)
    studies = {topic.study.name: topic.study for topic in of.values() if topic.study}
    results = {name: read_study(study, most, store, known) for name, study in studies.items()}
    tuned = read_pid(pid_jobs(scale, most), store)
    distances = alike.agent_distances(results["ladder"], (BEST,), store)
    asked: list[tuple[str, Question]] = []
    for topic in of.values():
        values = _values_of(topic, results, tuned, distances, FIRST_SEED[scale])
        asked += [(topic.name, q) for q in looks.questions(topic.claims, values, topic.metric)]
    decided = looks.decide_in_looks([q for _, q in asked], LOOKS[scale], SPENDING)
    decisions = {
        name: [each for (topic, _), each in zip(asked, decided, strict=True) if topic == name]
        for name in of
    }
    needed = _seeds_needed(scale, of, decisions)
    results = {name: looks.with_missing(each, needed[name]) for name, each in results.items()}
    verdicts = {name: [each.decision for each in found] for name, found in decisions.items()}
    return PaperResults(scale, results, tuned, distances, verdicts, needed)


def _values_of(
    topic: Topic,
    results: Mapping[str, StudyResults],
    tuned: Sequence[PidResult],
    distances: alike.AgentDistances | None,
    first_seed: int,
) -> SeedValues:
    """The numbers of a topic's claims."""
    if topic.name == "alike":

        def of_flights(cell: str, metric: str, seeds: int) -> FloatArray:
            if distances is None:
                return np.array([])
            return distances.until(first_seed + seeds).values(cell, metric)

        return of_flights
    if topic.study is None:

        def of_gains(cell: str, metric: str, seeds: int) -> FloatArray:
            del metric
            known = [
                each.test.summary.mean_return
                for each in tuned
                if each.job.tuning.tuner == cell and each.job.tuning.seed < first_seed + seeds
            ]
            return np.array(known, float)

        return of_gains
    return results[topic.study.name].named_until


def _seeds_needed(
    scale: Scale, of: Mapping[str, Topic], decisions: Mapping[str, Sequence[LookDecision]]
) -> dict[str, dict[str, int]]:
    """Seeds of each cell by study; several topics may ask about one."""
    needed: dict[str, dict[str, int]] = {}
    for topic in of.values():
        found = decisions[topic.name]
        if topic.name == "alike":
            further = [each.next_seeds or 0 for each in found]
            new = {BEST: max((LOOKS[scale][0], *further))}
        elif topic.study is not None:
            new = looks.seeds_of_cells(topic.study, topic.claims, found)
        else:
            new = dict.fromkeys((job.tuning.tuner for job in pid_jobs(scale)), LADDER_SEEDS[scale])
            for each in found:
                for cell in each.decision.claim.test.cells:
                    new[cell] = max(new[cell], each.next_seeds or LOOKS[scale][0])
        name = topic.name if topic.study is None else topic.study.name
        before = needed.setdefault(name, {})
        before |= {cell: max(seeds, before.get(cell, 0)) for cell, seeds in new.items()}
    return needed


def _pid_jobs(scale: Scale, wanted: Mapping[str, int]) -> list[PidJob]:
    first = FIRST_SEED[scale]
    return [
        job
        for job in pid_jobs(scale, max(wanted.values()))
        if job.tuning.seed < first + wanted[job.tuning.tuner]
    ]
