"""Estimates how long jobs will take, from the speed of each kind of run on this machine."""

import dataclasses
import multiprocessing
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeVar

from touchdown.config.config import Config
from touchdown.core import device, plugins, processes, records, threads
from touchdown.core.errors import Interrupted, UserError
from touchdown.core.starts import VALIDATION_STARTS
from touchdown.evaluation.evaluator import Evaluator
from touchdown.lander import engine as engines
from touchdown.lander import rules
from touchdown.policies import lookup
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.rows import EpisodeRow
from touchdown.studies.store import Store
from touchdown.studies.tuners import Tuning
from touchdown.studies.work import BaselineJob, PidJob, TrainJob
from touchdown.training import pid_tuning
from touchdown.training.pace import TrainingStatus
from touchdown.training.trainer import Trainer

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

_SECONDS_WARM = 1.0  # after compilation and the cheaper first steps
_SECONDS_MEASURED = 2.0
_FLIGHTS = 32


class Kind(NamedTuple):
    """The settings that determine a run's speed."""

    env_id: str
    algorithm: str
    hidden_sizes: tuple[int, ...]
    backend: str
    batch_size: int
    update_period: int
    num_envs: int
    prioritized: bool
    options: tuple[tuple[str, object], ...]


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is missing, and how long it will take."""

    missing: int
    """Training runs."""
    tunings: int
    """Number of missing PID tunings."""
    env_steps: int
    """Largest total environment steps of the runs, which may stop earlier."""
    seconds: float
    """Seconds of training, flights and tunings with the given workers."""
    measured: int
    """Kinds of run that were trained for a few seconds to measure their speed."""
    unrecorded: int = 0
    """Runs, tunings and baselines that lack only their flights."""

    def __str__(self) -> str:
        """The estimate as a sentence."""
        if not self.missing + self.tunings + self.unrecorded:
            return "nothing is missing"
        hours, minutes = divmod(max(1, round(self.seconds / 60)), 60)
        long = f"{hours} h {minutes} min" if hours else f"{minutes} min"
        runs = f"{self.missing} runs of {self.env_steps / 1e6:,.1f} million env steps"
        tunings = f"{self.tunings} PID tunings"
        flights = f"the flights of {self.unrecorded} baselines or finished runs"
        what = [runs] * (self.missing > 0) + [tunings] * (self.tunings > 0)
        what += [flights] * (self.unrecorded > 0)
        return (
            f"{' and '.join(what)} are missing: about {long} here, "
            "including the flights of validation and test"
        )


class _Pace(NamedTuple):
    env_steps: float
    """Environment steps per second."""
    validated: bool
    """Whether that time includes validations."""


class _FlightTimes(NamedTuple):
    engine: float
    """Seconds per flight in the training environment."""
    stock: float


def kind_of(config: Config) -> Kind:
    """The kind of a run."""
    learning = config.learning
    return Kind(
        config.env_id,
        config.algorithm,
        config.network.hidden_sizes,
        learning.backend,
        learning.batch_size,
        learning.update_period,
        config.training.num_envs,
        config.replay.prioritized,
        tuple(sorted(config.options.items())),
    )


def estimate(
    runs: Sequence[TrainJob],
    tunings: Sequence[PidJob],
    store: Store,
    workers: int,
    on_done: Callable[[float], object] = lambda _: None,
    *,
    baselines: Sequence[BaselineJob] = (),
) -> Estimate:
    """Estimate how long the missing jobs will take.

    Args:
        runs: all training runs, done or not.
        tunings: all PID tunings, done or not.
        store: its finished runs show the speed of their kind.
        workers: number of parallel jobs.
        on_done: called with the share of kinds whose speed is known.
        baselines: all baselines, done or not.
    """
    missing = store.without_results(runs)
    searches = [job.tuning for job in tunings if not job.has_results(store.runs)]
    paces = _known_paces([job for job in runs if job.has_results(store.runs)], store)
    unknown = {kind: job.config for job in missing if (kind := kind_of(job.config)) not in paces}
    # measured in parallel as they will run, since they are faster alone
    measured = _in_workers(_measure, list(unknown.values()), workers)
    for count, (kind, pace) in enumerate(zip(unknown, measured, strict=True), start=1):
        paces[kind] = pace
        on_done(count / len(unknown))
    times = {env_id: _fly(env_id) for env_id in {job.config.env_id for job in missing}}
    seconds = sum(
        _seconds_of(job.config, paces[kind_of(job.config)], times[job.config.env_id])
        for job in missing
    )
    if searches:
        trial = _try_gains(searches[0])
        seconds += sum(trial * (1 if each.tuner == "hand" else each.trials) for each in searches)
    # baselines and recorded flights take about a second each, so they are counted but not timed
    unrecorded = len(store.unrecorded([*runs, *tunings])) + len(store.missing(baselines))
    env_steps = sum(most_env_steps(job.config) for job in missing)
    return Estimate(
        len(missing), len(searches), env_steps, seconds / workers, len(unknown), unrecorded
    )


def most_env_steps(config: Config) -> int:
    """Largest number of environment steps of a run: its limit, or all episodes at full length."""
    training = config.training
    return training.max_env_steps or training.episodes * 1_000


def _seconds_of(config: Config, pace: _Pace, times: _FlightTimes) -> float:
    """Seconds of one run: training, checkpoint selection, and tests of two checkpoints."""
    training, env_steps = config.training, most_env_steps(config)
    flights = training.candidate_checkpoints * training.final_validation_episodes
    if not pace.validated:
        flights += env_steps // training.validation_period * training.validation_episodes
    return (
        env_steps / pace.env_steps
        + flights * times.engine
        + 2 * training.test_episodes * times.stock
    )


def _known_paces(done: Sequence[TrainJob], store: Store) -> dict[Kind, _Pace]:
    paces: dict[Kind, _Pace] = {}
    for job in done:
        kind = kind_of(job.config)
        if kind not in paces:
            path = RunFolder(store.runs / job.digest).episodes
            rows = records.decode_jsonl(path, EpisodeRow)
            if not rows:
                raise UserError(f"{path}: has no episodes, but its run is finished")
            paces[kind] = _Pace(rows[-1].env_steps / max(rows[-1].seconds, 1e-9), validated=True)
    return paces


def _fly(env_id: str) -> _FlightTimes:
    """Time flights of the PID, which are as long as a good agent's; elsewhere random ones."""
    policy = lookup.load("pid" if rules.is_lander(env_id) else "random", env_id=env_id).policy
    seconds: list[float] = []
    for engine in (engines.engine_in_use(), "gymnasium"):
        with closing(Evaluator(env_id, engine=engine)) as evaluator:
            began = time.perf_counter()
            evaluator.rollout(policy, VALIDATION_STARTS[:_FLIGHTS])
            seconds.append((time.perf_counter() - began) / _FLIGHTS)
    return _FlightTimes(*seconds)


def _try_gains(search: Tuning) -> float:
    """Seconds of one trial of a PID tuning."""
    with pid_tuning.Objective(search.rule, search.starts, search.seed) as objective:
        began = time.perf_counter()
        objective(objective.point_of(pid_tuning.HAND_PICKED))
        return time.perf_counter() - began


def _in_workers(
    task: Callable[[_Item], _Result], items: Sequence[_Item], workers: int
) -> Iterator[_Result]:
    """The result of a task for each item, computed in processes, which end with this generator."""
    if not items:
        return
    others = set(multiprocessing.active_children())
    with (
        threads.one_thread_each(),
        ProcessPoolExecutor(
            min(workers, len(items)),
            mp_context=multiprocessing.get_context("spawn"),
            initializer=processes.leave_stopping_to_the_parent,
        ) as pool,
    ):
        try:
            yield from pool.map(task, items)
        except BaseException:
            # the pool would wait for what its workers are doing
            for worker in set(multiprocessing.active_children()) - others:
                worker.terminate()
                worker.join()
            raise


def _measure(config: Config) -> _Pace:
    """Measure the pace of one kind of run, once it updates its network."""
    device.use_default()
    plugins.allow(*config.own_code.values())  # the caller has checked them
    training = dataclasses.replace(
        config.training, max_env_steps=0, episodes=1_000_000, validation_period=10**9
    )
    seen: list[tuple[float, int]] = []

    def look(status: TrainingStatus) -> None:
        if status.env_steps >= config.replay.min_size:
            seen.append((time.monotonic(), status.env_steps))

    def is_over() -> bool:
        if len(seen) < 3 or seen[-2][0] - seen[0][0] < _SECONDS_WARM:
            return False  # two episodes must have ended after the warm-up
        return time.monotonic() - seen[0][0] > _SECONDS_WARM + _SECONDS_MEASURED

    with tempfile.TemporaryDirectory() as name:
        folder = folders.create(Path(name), dataclasses.replace(config, training=training), "kind")
        trainer = Trainer(folder, should_stop=is_over, on_status=look)
        with closing(trainer), suppress(Interrupted):
            trainer.run()
    warm = [each for each in seen if each[0] - seen[0][0] >= _SECONDS_WARM]
    (began, first), (ended, last) = warm[0], warm[-1]
    return _Pace(max(last - first, 1) / max(ended - began, 1e-3), validated=False)
