"""Where a run comes from: versions, machine, seeds, engine."""

import platform
import subprocess
import sys
from importlib import metadata
from pathlib import Path

from touchdown.config.config import Config
from touchdown.core import device, threads
from touchdown.lander.engine import engine_in_use
from touchdown.lander.rules import is_lander

FORMAT_VERSION = 1
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


def provenance_of(config: Config) -> dict[str, object]:
    """Where a run of these settings comes from, as values for JSON."""
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
        "cpus_available": threads.available(),
        "engine": engine_in_use() if is_lander(config.env_id) else "gymnasium",
        "device": device.chosen(),
        "threads": threads.threads() if device.chosen() == "cpu" else None,
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
