"""A preset of this project, trained as a separate run."""

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
from touchdown.runs.run import load_run
from touchdown.training.trainer import Trainer

_POLL_SECONDS = 0.02


class _Keeper:
    """Keeps every best policy of a run during training, with its time.

    A run overwrites its best policy whenever it finds a better one. This class polls that file, so
    that it needs no access to the training.
    """

    def __init__(self, path: Path, clock: Stopwatch) -> None:
        self.kept: list[tuple[float, bytes]] = []
        self._path = path
        self._clock = clock
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._poll, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop polling."""
        self._ended.set()
        self._thread.join()

    def _poll(self) -> None:
        seen = 0
        while not self._ended.wait(_POLL_SECONDS):
            if self._path.is_file() and (now := self._path.stat().st_mtime_ns) != seen:
                self.kept.append((self._clock.seconds(), self._path.read_bytes()))
                seen = now


def seconds_to_decision(folder: RunFolder) -> float:
    """Seconds until a run decided to stop training early, from its records.

    They count from the creation of the agent, including compilation and validations.

    Raises:
        UserError: the records of the run are broken.
    """
    solved = policy_weights.facts_of(folder.best).solved_seconds
    return solved or files.read_jsonl(folder.episodes)[-1]["seconds"]


def train(name: str, config: Config, runs: Path, judge: Judge) -> None:
    """Train once from scratch, then evaluate every best policy of the run.

    Args:
        name: name of the run.
        config: config of the run.
        runs: folder for the run; an unfinished run with that name is deleted, because its clock
            would not include the time to restart.
        judge: evaluates the policies.
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
        env_steps = policy_weights.facts_of(held).env_steps
        judge.look(policy_weights.load_weights(held).policy, held_since, env_steps, chosen=True)
    held.unlink(missing_ok=True)
    env_steps = files.read_jsonl(folder.episodes)[-1]["observations"]
    judge.look(load_run(folder).policy, seconds, env_steps, chosen=True, last=True)


def config_of(preset: str, seed: int, cap: int | None) -> Config:
    """The config of a preset with a seed, and at most `cap` environment steps if given."""
    config = replace(presets.preset(preset), seed=seed)
    if cap is None:
        return config
    return replace(config, training=replace(config.training, max_env_steps=cap))
