"""How long jobs will take, from how fast their kinds are on this machine."""

import dataclasses
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from touchdown import device, files
from touchdown.config import Config
from touchdown.errors import Interrupted
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.train import Status, Trainer
from touchdown.studies.store import Store
from touchdown.studies.work import TrainJob

_SECONDS_WARM = 1.0  # that compilation and the first, emptier steps are over by
_SECONDS_MEASURED = 2.0


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
    """Of training, with so many workers; validation and test flights come on top."""
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
            f"missing: about {long} of training here, and the flights of validation and test on top"
        )


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
    speeds = _known_speeds([job for job in jobs if job.is_done(store.runs)], store)
    wanted = {kind_of(job.config): job.config for job in missing}
    unknown = [kind for kind in wanted if kind not in speeds]
    for count, kind in enumerate(unknown, start=1):
        speeds[kind] = _measure(wanted[kind])
        on_done(count / len(unknown))
    counts: Counter[Kind] = Counter()
    for job in missing:
        counts[kind_of(job.config)] += most_observations(job.config)
    return Estimate(
        len(missing),
        counts.total(),
        sum(count / speeds[kind] for kind, count in counts.items()) / workers,
        len(unknown),
    )


def most_observations(config: Config) -> int:
    """Observations that a run may have: its limit, or all episodes at full length."""
    training = config.training
    return training.max_observations or training.episodes * 1_000


def _known_speeds(done: Sequence[TrainJob], store: Store) -> dict[Kind, float]:
    speeds: dict[Kind, float] = {}
    for job in done:
        kind = kind_of(job.config)
        if kind not in speeds:
            path = RunFolder(store.runs / job.digest).episodes
            last = files.read_jsonl(path, ("observations", "seconds"))[-1]
            speeds[kind] = last["observations"] / max(last["seconds"], 1e-9)
    return speeds


def _measure(config: Config) -> float:
    """Observations a second of one kind of run, once it learns."""
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
    return max(last - first, 1) / max(ended - began, 1e-3)
