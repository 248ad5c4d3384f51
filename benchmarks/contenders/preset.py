"""A preset of this project, trained as a run of its own."""

import shutil
import threading
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from contenders.watch import Judge, Stopwatch
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.core import device, files
from touchdown.policies import weights as policy_weights
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.training.trainer import Trainer

_BETWEEN_GLANCES = 0.02  # seconds


class _Keeper:
    """Keeps every policy that a run holds on its way, and since when.

    A run writes the best that it has found, whole, in the place of the one before. This takes a
    glance at the file, so that it knows nothing of how the run is trained.
    """

    def __init__(self, path: Path, clock: Stopwatch) -> None:
        self.kept: list[tuple[float, bytes]] = []
        self._path = path
        self._clock = clock
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._glance, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Look no more."""
        self._ended.set()
        self._thread.join()

    def _glance(self) -> None:
        seen = 0
        while not self._ended.wait(_BETWEEN_GLANCES):
            if self._path.is_file() and (now := self._path.stat().st_mtime_ns) != seen:
                self.kept.append((self._clock.seconds(), self._path.read_bytes()))
                seen = now


def seconds_to_decision(folder: RunFolder) -> float:
    """Seconds until a run knew that it had trained enough, as its own records have them.

    They count from where the agent is made, with all that is compiled and with its validations.

    Raises:
        UserError: the run's records are broken.
    """
    solved = policy_weights.facts_of(folder.best).solved_seconds
    return solved or files.read_jsonl(folder.episodes)[-1]["seconds"]


def train(name: str, config: Config, runs: Path, judge: Judge) -> None:
    """Train once, from nothing, then look at all that the run held on its way.

    Args:
        name: of the run.
        config: of the run.
        runs: folder to make the run in; an unfinished one of that name gives way, for its clock
            has not counted the time to begin again.
        judge: flies what was held.
    """
    device.use_default()
    shutil.rmtree(runs / name, ignore_errors=True)
    clock = Stopwatch()
    folder = folders.create(runs, config, name)
    with closing(_Keeper(folder.best, clock)) as keeper, closing(Trainer(folder)) as trainer:
        trainer.run()
        seconds = clock.seconds()
    held = folder.path / "held.safetensors"
    for held_since, weights in keeper.kept:
        held.write_bytes(weights)
        observations = policy_weights.facts_of(held).env_steps
        judge.look(policy_weights.load_weights(held).policy, held_since, observations, chosen=True)
    held.unlink(missing_ok=True)
    observations = files.read_jsonl(folder.episodes)[-1]["observations"]
    judge.look(runs.load_run(folder).policy, seconds, observations, chosen=True, last=True)


def config_of(preset: str, seed: int, cap: int | None) -> Config:
    """A preset's settings with a seed, for so many observations at most where there is a cap."""
    config = replace(presets.preset(preset), seed=seed)
    if cap is None:
        return config
    return replace(config, training=replace(config.training, max_env_steps=cap))
