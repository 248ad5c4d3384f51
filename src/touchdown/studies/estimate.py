"""How long jobs will take, from how fast their kinds are on this machine."""

import dataclasses
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from touchdown import device, files
from touchdown.config import Config
from touchdown.errors import Interrupted
from touchdown.lander import env as lander
from touchdown.runs import folder as folders
from touchdown.runs import pilots
from touchdown.runs.evaluate import Fleet
from touchdown.runs.folder import RunFolder
from touchdown.runs.train import Status, Trainer
from touchdown.seeding import VALIDATION_STARTS
from touchdown.studies.store import Store
from touchdown.studies.work import TrainJob

_SECONDS_WARM = 1.0  # that compilation and the first, emptier steps are over by
_SECONDS_MEASURED = 2.0
_FLIGHTS = 32


class Kind(NamedTuple):
    """What decides a run's speed."""

    algorithm: str
    hidden_sizes: tuple[int, ...]
    backend: str
    batch_size: int
    update_period: int
    num_envs: int
    prioritized: bool


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is still to be done, and how long it will take."""

    missing: int
    """Training runs."""
    observations: int
    """At most: what episodes and validations end early is not known before."""
    seconds: float
    """Of training and flights, with so many workers."""
    measured: int
    """Kinds of run that were flown to know."""

    def __str__(self) -> str:
        """In a sentence."""
        if not self.missing:
            return "nothing is missing"
        hours, minutes = divmod(max(1, round(self.seconds / 60)), 60)
        long = f"{hours} h {minutes} min" if hours else f"{minutes} min"
        return (
            f"{self.missing} runs of {self.observations / 1e6:,.1f} million observations are "
            f"missing: about {long} here, the flights of validation and test counted"
        )


class _Pace(NamedTuple):
    observations: float
    """A second."""
    validated: bool
    """Whether the validations on the way took a part of that time."""


class _FlightTimes(NamedTuple):
    engine: float
    """Seconds of one flight in the world that training flies."""
    stock: float


def kind_of(config: Config) -> Kind:
    """The kind of a run."""
    learning = config.learning
    return Kind(
        config.algorithm,
        config.network.hidden_sizes,
        learning.backend,
        learning.batch_size,
        learning.update_period,
        config.training.num_envs,
        config.replay.prioritized,
    )


def estimate(
    jobs: Sequence[TrainJob],
    store: Store,
    workers: int,
    on_done: Callable[[float], object] = lambda _: None,
) -> Estimate:
    """How long the missing training runs will take.

    Args:
        jobs: all, done or not.
        store: finished runs there tell the speed of their kind.
        workers: runs at a time.
        on_done: told the share of kinds that are known.
    """
    missing = store.missing(jobs)
    paces = _known_paces([job for job in jobs if job.is_done(store.runs)], store)
    wanted = {kind_of(job.config): job.config for job in missing}
    unknown = [kind for kind in wanted if kind not in paces]
    for count, kind in enumerate(unknown, start=1):
        paces[kind] = _measure(wanted[kind])
        on_done(count / len(unknown))
    times = {env_id: _fly(env_id) for env_id in {job.config.env_id for job in missing}}
    seconds = sum(
        _seconds_of(job.config, paces[kind_of(job.config)], times[job.config.env_id])
        for job in missing
    )
    observations = sum(most_observations(job.config) for job in missing)
    return Estimate(len(missing), observations, seconds / workers, len(unknown))


def most_observations(config: Config) -> int:
    """Observations that a run may have: its limit, or all episodes at full length."""
    training = config.training
    return training.max_observations or training.episodes * 1_000


def _seconds_of(config: Config, pace: _Pace, times: _FlightTimes) -> float:
    """Of one run: training, the choice among its checkpoints, and the test of two of them."""
    training, observations = config.training, most_observations(config)
    flights = training.finalists * training.final_validation_episodes
    if not pace.validated:
        flights += observations // training.validation_period * training.validation_episodes
    return (
        observations / pace.observations
        + flights * times.engine
        + 2 * training.test_episodes * times.stock
    )


def _known_paces(done: Sequence[TrainJob], store: Store) -> dict[Kind, _Pace]:
    paces: dict[Kind, _Pace] = {}
    for job in done:
        kind = kind_of(job.config)
        if kind not in paces:
            path = RunFolder(store.runs / job.digest).episodes
            last = files.read_jsonl(path, ("observations", "seconds"))[-1]
            paces[kind] = _Pace(last["observations"] / max(last["seconds"], 1e-9), validated=True)
    return paces


def _fly(env_id: str) -> _FlightTimes:
    """Time flights of the PID, which are as long as a good agent's; elsewhere those of chance."""
    pilot = pilots.load("pid" if lander.is_lander(env_id) else "random", env_id=env_id).pilot
    seconds: list[float] = []
    for engine in (lander.engine_in_use(), "gymnasium"):
        with closing(Fleet(env_id, engine=engine)) as fleet:
            began = time.perf_counter()
            fleet.fly(pilot, VALIDATION_STARTS[:_FLIGHTS])
            seconds.append((time.perf_counter() - began) / _FLIGHTS)
    return _FlightTimes(*seconds)


def _measure(config: Config) -> _Pace:
    """The pace of one kind of run, once it learns."""
    device.use_default()
    training = dataclasses.replace(
        config.training, max_observations=0, episodes=1_000_000, validation_period=10**9
    )
    seen: list[tuple[float, int]] = []

    def look(status: Status) -> None:
        if status.observations >= config.replay.min_size:
            seen.append((time.monotonic(), status.observations))

    def over() -> bool:
        return bool(seen) and time.monotonic() - seen[0][0] > _SECONDS_WARM + _SECONDS_MEASURED

    with tempfile.TemporaryDirectory() as name:
        folder = folders.create(Path(name), dataclasses.replace(config, training=training), "kind")
        trainer = Trainer(folder, should_stop=over, on_status=look)
        with closing(trainer), suppress(Interrupted):
            trainer.run()
    warm = [each for each in seen if each[0] - seen[0][0] >= _SECONDS_WARM]
    (began, first), (ended, last) = warm[0], warm[-1]
    return _Pace(max(last - first, 1) / max(ended - began, 1e-3), validated=False)
