"""Provenance of a run: versions, machine, seeds, engine."""

import platform
import subprocess
import sys
from pathlib import Path
from typing import Literal

from msgspec import Struct, field

from touchdown.config.config import Config
from touchdown.core import device, installation, records, threads
from touchdown.core.records import Count
from touchdown.lander.engine import Engine, engine_built, engine_in_use
from touchdown.lander.rules import is_lander
from touchdown.runs.loop import Loop, why_python

FORMAT_VERSION = 1
_RECORDED_PACKAGES = (
    "gymnasium",
    "box2d",
    "jax",
    "jaxlib",
    "equinox",
    "optax",
    "numpy",
)


class Provenance(Struct, frozen=True, kw_only=True):
    """`provenance.json`; fields that are only informative may be missing."""

    format_version: Literal[1] = FORMAT_VERSION
    config_digest: str = ""
    seed: Count = 0
    """Training seed."""
    python: str = ""
    """Its version."""
    versions: dict[str, str] = field(default_factory=dict[str, str])
    """Versions of the packages that results depend on, by name."""
    git_commit: str | None = None
    """Commit of the source; None if it is not in a git repository."""
    platform: str = ""
    cpu: str = ""
    cpus_available: Count = 0
    """Number of cores that the run could use."""
    engine: Engine = "gymnasium"
    """Engine that simulated the training episodes."""
    loop: Loop = "python"
    """Training loop; results are the same."""
    why_python: str | None = None
    """Why the loop was Python's and not the compiled one; None of the latter."""
    simd: str | None = None
    """Instruction set of the C++ code; None if it was not built. The engine gives the same bytes
    with each, fused updates round differently."""
    device: str = ""
    """Device that JAX computed on."""
    threads: Count | None = None
    """Threads that the run could use, on which results do not depend; None on a GPU."""


def provenance_of(config: Config) -> Provenance:
    """The provenance of a new run with these settings."""
    reason = why_python(config)
    return Provenance(
        config_digest=config.digest,
        seed=config.seed,
        python=sys.version.split()[0],
        versions=installation.versions(_RECORDED_PACKAGES),
        git_commit=_git_commit(),
        platform=platform.platform(),
        cpu=cpu_name(),
        cpus_available=threads.available(),
        engine=engine_in_use() if is_lander(config.env_id) else "gymnasium",
        loop="compiled" if reason is None else "python",
        why_python=reason,
        simd=_simd(),
        device=device.chosen(),
        threads=threads.threads() if device.chosen() == "cpu" else None,
    )


def read_provenance(path: Path) -> Provenance:
    """The provenance that `folder.create` wrote.

    Raises:
        UserError: the file is missing, broken or of another version.
    """
    return records.decode_json(path, Provenance)


def _git_commit() -> str | None:
    """The commit of this code; None if it is installed, perhaps inside another repository."""
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


def _simd() -> str | None:
    if not engine_built():
        return None
    from touchdown.lander._engine import simd  # noqa: PLC0415 - it may not have been built

    return simd()


def cpu_name() -> str:
    """The name of the processor."""
    try:
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
