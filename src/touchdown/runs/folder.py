"""A run's folder: what lies where, how a new one is named, and how one is found."""

import fcntl
import platform
import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import IO

from touchdown import config as configs
from touchdown import cores, device, files
from touchdown.config import Config
from touchdown.errors import UserError
from touchdown.lander.env import engine_in_use, is_lander

FORMAT_VERSION = 1
CONTROLLERS = ("pid", "heuristic", "random")
"""Pilots that need no run, and so names that no run may have."""
PILOT_FILES = (".toml", ".safetensors", ".onnx", ".zip")
"""Endings of files that hold a pilot, and so of no run's name."""
DEFAULT_RUNS = Path("runs")
_RECORDED_PACKAGES = (
    "touchdown",
    "gymnasium",
    "box2d",
    "jax",
    "jaxlib",
    "equinox",
    "optax",
    "numpy",
)


@dataclass(frozen=True, slots=True)
class RunFolder:
    """`runs/<name>/` and the files in it."""

    path: Path

    @property
    def name(self) -> str:
        """The run's name."""
        return self.path.name

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
        """One line a training episode."""
        return self.path / "episodes.jsonl"

    @property
    def updates(self) -> Path:
        """One line every few updates."""
        return self.path / "updates.jsonl"

    @property
    def validations(self) -> Path:
        """One line a flight on the validation starts."""
        return self.path / "validations.jsonl"

    @property
    def checkpoints(self) -> Path:
        """Where training goes on from, and the best weights."""
        return self.path / "checkpoints"

    @property
    def best(self) -> Path:
        """The weights that did best on the validation starts."""
        return self.checkpoints / "best.safetensors"

    @property
    def evaluation(self) -> Path:
        """The test flights of a finished run."""
        return self.path / "evaluation.json"

    def config(self) -> Config:
        """The run's settings.

        Raises:
            UserError: `config.toml` is missing or broken.
        """
        return configs.from_toml(self.config_file)


def create(runs_dir: Path, config: Config, name: str | None = None) -> RunFolder:
    """A new run's folder with its config and provenance written.

    Args:
        runs_dir: where runs are kept; made if it is not there.
        config: of the run.
        name: of the run; `<preset>-<seed>` if None, with a number behind it if that is taken.

    Raises:
        UserError: the name is taken or no file name, or the folder cannot be written.
    """
    if name is not None and not configs.is_plain_name(name):
        raise UserError(
            f"name {name!r}: must be a plain folder name of letters, digits, '.', '_' and '-', "
            "such as pilot-0"
        )
    if name in CONTROLLERS or (name and name.endswith(PILOT_FILES)):
        raise UserError(f"name {name!r}: means another pilot to evaluate and fly; choose another")
    default = f"{config.preset}-{config.seed}"

    def fill(path: Path) -> None:
        folder = RunFolder(path)
        folder.checkpoints.mkdir()
        folder.provenance.write_text(files.to_json(_provenance(config)), "utf-8")
        folder.config_file.write_text(configs.to_toml(config), "utf-8")

    with files.refusing(f"runs_dir {str(runs_dir)!r}"):
        runs_dir.mkdir(parents=True, exist_ok=True)
        path, number = runs_dir / (name or default), 1
        while True:
            try:
                files.write_folder_atomic(path, fill)
            except OSError:
                if not path.exists():
                    raise
                if name:
                    raise UserError(
                        f"name {name!r}: {path} exists already; choose another, "
                        f"or go on with it: --resume {name}"
                    ) from None
                number += 1
                path = runs_dir / f"{default}-{number}"
            else:
                return RunFolder(path)


def lock(folder: RunFolder) -> IO[bytes]:
    """The right to write to a run, until the file given back is closed or its process dies.

    Raises:
        UserError: another process is training the run.
    """
    file = (folder.path / "lock").open("ab")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise UserError(f"run {folder.name!r}: another process is training it") from None
    return file


def find(name: str, runs_dir: Path = DEFAULT_RUNS) -> RunFolder:
    """The run of that name in `runs_dir`, or at that path.

    Raises:
        UserError: there is no such folder, or it holds no run.
    """
    for path in (runs_dir / name, Path(name)):
        if path.is_dir():
            folder = RunFolder(path)
            if not folder.config_file.is_file():
                raise UserError(f"run {str(path)!r}: holds no config.toml, so it is not a run")
            return folder
    raise UserError(
        f"run {name!r}: no such folder in {str(runs_dir)!r}; `touchdown runs` lists them"
    )


def list_runs(runs_dir: Path = DEFAULT_RUNS) -> list[RunFolder]:
    """Every run in a folder, oldest first."""
    found = [RunFolder(path.parent) for path in runs_dir.glob("*/config.toml")]
    return sorted(found, key=lambda folder: (folder.config_file.stat().st_mtime, folder.name))


def _provenance(config: Config) -> dict[str, object]:
    versions = {name: metadata.version(name) for name in _RECORDED_PACKAGES}
    return {
        "format_version": FORMAT_VERSION,
        "config_digest": config.digest,
        "seed": config.seed,
        "python": sys.version.split()[0],
        "versions": versions,
        "git_commit": _git_commit(),
        "platform": platform.platform(),
        "cpu": cpu_name(),
        "cpus_available": cores.available(),
        "engine": engine_in_use() if is_lander(config.env_id) else "gymnasium",
        "device": device.chosen(),
        "threads": cores.threads() if device.chosen() == "cpu" else None,
    }


def _git_commit() -> str | None:
    """The commit of this code; None where it is installed, perhaps inside another repository."""
    here = Path(__file__)
    said = ""
    for arguments in (
        ["ls-files", "--error-unmatch", here.name],
        ["describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
    ):
        try:
            done = subprocess.run(  # noqa: S603
                ["git", *arguments],  # noqa: S607
                cwd=here.parent,
                capture_output=True,
                text=True,
                timeout=5,
                check=True,
            )
        except (OSError, subprocess.SubprocessError):
            return None
        said = done.stdout.strip()
    return said or None


def cpu_name() -> str:
    """The processor, in words."""
    try:
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
