"""A run's folder: the paths of its files, its name, and how to find it."""

import fcntl
import shlex
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from touchdown.config import checks, toml
from touchdown.config import config as configs
from touchdown.config.config import Config
from touchdown.core import files, reading
from touchdown.core.errors import UserError
from touchdown.core.names import hint
from touchdown.core.terminal import printable
from touchdown.policies.names import BASELINES, OTHER_FILES, POLICY_FILES
from touchdown.runs.provenance import provenance_of

DEFAULT_RUNS = Path("runs")
_LOCK_PAUSES = (0.01, 0.03, 0.1, 0.3, 0.0)
"""Seconds between attempts to lock a run, because `is_locked` may hold the lock for an instant."""


@dataclass(frozen=True, slots=True)
class RunFolder:
    """`runs/<name>/` and the files in it."""

    path: Path
    _config: Config | None = field(default=None, repr=False, compare=False)
    """Config of a run that this process created, so that it is not read back from the disk."""

    @property
    def name(self) -> str:
        """The run's name, as it is shown: a folder may be named with bytes that are no text."""
        return printable(self.path.name)

    def resume_command(self, *flags: str) -> str:
        """The command that continues the run, quoted for a shell.

        Args:
            flags: further words, such as `--trust`.
        """
        return self._command(["--resume", self.name], flags)

    def restart_command(self, *flags: str) -> str:
        """The command that trains another run with the same settings, quoted for a shell.

        Args:
            flags: further words, such as `--trust`.
        """
        return self._command(["--config", str(self.config_file)], flags)

    def _command(self, words: Sequence[str], flags: Sequence[str]) -> str:
        where = self.path.parent
        place = [] if where == DEFAULT_RUNS else ["--runs-dir", str(where)]
        return shlex.join(["touchdown", "train", *words, *place, *flags])

    @property
    def config_file(self) -> Path:
        """Every setting of the run."""
        return self.path / "config.toml"

    @property
    def provenance(self) -> Path:
        """Versions, machine and seeds."""
        return self.path / "provenance.json"

    @property
    def episodes(self) -> Path:
        """One line per training episode."""
        return self.path / "episodes.jsonl"

    @property
    def updates(self) -> Path:
        """One line every `metrics_period` updates."""
        return self.path / "updates.jsonl"

    @property
    def validations(self) -> Path:
        """One line per validation."""
        return self.path / "validations.jsonl"

    @property
    def training_flights(self) -> Path:
        """Start and actions of each training episode; of the lander only."""
        return self.path / "training-flights.jsonl"

    @property
    def checkpoints(self) -> Path:
        """The state that training resumes from, and the best weights."""
        return self.path / "checkpoints"

    @property
    def best(self) -> Path:
        """The weights with the best return on validation starts."""
        return self.checkpoints / "best.safetensors"

    @property
    def over_training(self) -> Path:
        """The policies at the validations."""
        return self.checkpoints / "over-training"

    @property
    def evaluation(self) -> Path:
        """The test episodes of a finished run."""
        return self.path / "evaluation.json"

    @property
    def flights(self) -> Path:
        """Recorded flights; the first has the median test return."""
        return self.path / "flights.safetensors"

    @property
    def paths(self) -> Path:
        """Positions of the lander at each step of the first test flights."""
        return self.path / "paths.safetensors"

    @property
    def loggers(self) -> Path:
        """What identifies the run at logging services; of a run that has used one."""
        return self.path / "loggers.json"

    def config(self) -> Config:
        """The run's settings.

        Raises:
            UserError: `config.toml` is missing or broken.
        """
        return configs.from_toml(self.config_file) if self._config is None else self._config


def create(runs_dir: Path, config: Config, name: str | None = None) -> RunFolder:
    """Create a new run's folder and write its config and provenance.

    Args:
        runs_dir: folder for runs; created if it does not exist.
        config: the run's config.
        name: name of the run; None uses `<preset>-<seed>`, with a number appended if that is taken.

    Raises:
        UserError: the name is taken or not a plain folder name, or the folder cannot be written.
    """
    if name is not None and not checks.is_plain_name(name):
        raise UserError(
            f"name {name!r}: must be a plain folder name of letters, digits, '.', '_' and '-', "
            "such as pilot-0"
        )
    if name in BASELINES or (name and name.endswith((*POLICY_FILES, *OTHER_FILES))):
        raise UserError(f"name {name!r}: is already the name of a policy; choose another")
    default = f"{config.preset}-{config.seed}"

    def fill(path: Path) -> None:
        folder = RunFolder(path)
        folder.checkpoints.mkdir()
        folder.provenance.write_text(files.to_json(provenance_of(config)), "utf-8")
        folder.config_file.write_text(toml.to_toml(config), "utf-8")

    with files.refusing(f"runs_dir {str(runs_dir)!r}"):
        files.make_folder(runs_dir)
        path, number = runs_dir / (name or default), 1
        while True:
            try:
                files.write_folder_atomic(path, fill)
            except OSError:
                if not path.exists():
                    raise
                if name:
                    taken = RunFolder(path).resume_command()
                    raise UserError(
                        f"name {name!r}: {path} exists already; choose another, "
                        f"or resume it with: {taken}"
                    ) from None
                number += 1
                path = runs_dir / f"{default}-{number}"
            else:
                return RunFolder(path, config)


def lock(folder: RunFolder) -> BinaryIO:
    """Lock a run for writing, until the returned file is closed or its process ends.

    Raises:
        UserError: another process is training the run, or its lock is not a regular file.
    """
    file = reading.open_appendable(folder.path / "lock")
    for pause in _LOCK_PAUSES:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(pause)
        else:
            return file
    file.close()
    raise UserError(f"run {folder.name!r}: another process is training it")


def is_locked(folder: RunFolder) -> bool:
    """Whether a process is training the run.

    To find out, this holds the lock for an instant.
    """
    try:
        with reading.open_regular(folder.path / "lock") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except (OSError, UserError):  # no lock: it was never trained
        return False
    return False


def find(name: str, runs_dir: Path = DEFAULT_RUNS) -> RunFolder:
    """The run with that name in `runs_dir`, or at that path.

    Raises:
        UserError: there is no such folder, or it does not contain a run.
    """
    # an empty name would be the folder of the runs
    for path in (runs_dir / name, Path(name)) if name else ():
        if path.is_dir():
            folder = RunFolder(path)
            if not folder.config_file.is_file():
                raise UserError(f"run {str(path)!r}: not a run, because it has no config.toml")
            return folder
    if name and Path(name).is_file():
        raise UserError(f"run {name!r}: is a file; must be a run's name or folder")
    found = [path.parent.name for path in runs_dir.glob("*/config.toml")]
    raise UserError(
        f"run {name!r}: no such folder in {str(runs_dir)!r}; "
        f"{hint(name, found, '`touchdown runs` lists them')}"
    )


def list_runs(runs_dir: Path = DEFAULT_RUNS) -> list[RunFolder]:
    """Every run in a folder, oldest first."""
    found = [RunFolder(path.parent) for path in runs_dir.glob("*/config.toml")]
    return sorted(found, key=lambda folder: (folder.config_file.stat().st_mtime, folder.name))
