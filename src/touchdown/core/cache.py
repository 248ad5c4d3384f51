"""The user's cache folder: what can be computed again, kept for later processes."""

import hashlib
import os
import platform
from pathlib import Path


def folder(kind: str) -> Path | None:
    """The folder `kind` of the user's cache, created; None if it cannot be.

    Each kind of processor has its own, because compiled code and rounding depend on it, and several
    machines may share a home folder.
    """
    try:
        cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        made = cache / "touchdown" / f"{kind}-{_processor()}"
        made.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # a full disk, a user without a home folder
        return None
    return made


def _processor() -> str:
    """A digest of the kind of processor, as 12 hex digits."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
        about = [line for line in lines if line.startswith(("model name", "flags", "Features"))]
    except OSError:
        about = []
    text = "\n".join(sorted(set(about))) or f"{platform.machine()} {platform.processor()}"
    return hashlib.sha256(text.encode()).hexdigest()[:12]
