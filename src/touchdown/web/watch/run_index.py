"""The runs that a server may show, found by keys that no path can be made of."""

import hashlib
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from touchdown.core.errors import UserError
from touchdown.core.terminal import printable_line
from touchdown.runs.folder import RunFolder
from touchdown.web.watch.facts import identity_of, status_of

_FRESH_SECONDS = 1.0
"""For which a listing is used again."""


@dataclass(frozen=True, slots=True)
class IndexedRun:
    """One run that may be shown."""

    key: str
    folder: RunFolder
    label: str
    group: str


@dataclass(frozen=True, slots=True)
class StudyRuns:
    """The runs of a study."""

    folder: Path
    """The folder of the runs of all studies."""
    labels: Mapping[str, Mapping[str, str]]
    """By the name of the study: what each run is called, by the name of its folder."""


class RunIndex:
    """The runs in a folder, those of the studies in it, and those that the user named.

    Requests name a run by its key, which is looked up here, so that no request can lead elsewhere.
    A folder that a symbolic link leads out of the runs' folder to is not in the index, unless the
    user named it.

    Args:
        runs_dir: folder of the runs.
        named: runs that the user named; they may be anywhere.
        studies: reads the runs of studies; it may raise no error.
    """

    def __init__(
        self,
        runs_dir: Path,
        named: Sequence[RunFolder] = (),
        studies: Callable[[], StudyRuns | None] = lambda: None,
    ) -> None:
        self._runs_dir = runs_dir
        self._named = named
        self._studies = studies
        self._found: dict[str, IndexedRun] = {}
        self._until = 0.0
        self._damaged: dict[Path, tuple[tuple[int, int], bool]] = {}

    def all(self) -> list[IndexedRun]:
        """Every run: first those that the user named, then the newest."""
        if time.monotonic() >= self._until:
            self._found = self._find()
            self._until = time.monotonic() + _FRESH_SECONDS
        return list(self._found.values())

    def find(self, key: str) -> IndexedRun | None:
        """The run with a key; None if there is none."""
        if key not in self._found:
            self.all()
        return self._found.get(key)

    def listing(self) -> list[dict[str, Any]]:
        """What a list of the runs shows, as JSON objects, those under way first."""
        rows = [
            {
                "key": run.key,
                "label": run.label,
                "group": run.group,
                "status": "damaged" if self._is_damaged(run.folder) else status_of(run.folder),
                "changed": _changed(run.folder),
            }
            for run in self.all()
        ]
        return sorted(rows, key=lambda row: (row["status"] != "training", -row["changed"]))

    def _is_damaged(self, folder: RunFolder) -> bool:
        """Whether a run's config cannot be read; it is read once."""
        try:
            config_file = identity_of(folder.config_file)
        except (OSError, UserError):
            return True
        known = self._damaged.get(folder.path)
        if known is None or known[0] != config_file:
            known = config_file, not _has_config(folder)
            self._damaged[folder.path] = known
        return known[1]

    def _find(self) -> dict[str, IndexedRun]:
        found: dict[str, IndexedRun] = {}

        def add(folder: RunFolder, label: str, group: str = "") -> None:
            key = key_of(folder)
            found.setdefault(key, IndexedRun(key, folder, printable_line(label), group))

        studies = self._studies()
        labels = {} if studies is None else _labels(studies)
        for folder in self._named:
            label, group = labels.get(folder.path.name, (folder.name, ""))
            add(folder, label, group)
        for folder in reversed(_inside(self._runs_dir)):
            add(folder, folder.name)
        for folder in [] if studies is None else _inside(studies.folder):
            label, group = labels.get(folder.path.name, (folder.name, "other studies"))
            add(folder, label, group)
        return found


def key_of(folder: RunFolder) -> str:
    """What names a run to pages: 16 hex digits."""
    path = os.fsencode(os.path.abspath(folder.path))  # noqa: PTH100 - a link keeps its own name
    return hashlib.sha256(path).hexdigest()[:16]


def _labels(studies: StudyRuns) -> dict[str, tuple[str, str]]:
    """The label and the study of each run, by the name of its folder."""
    found: dict[str, tuple[str, str]] = {}
    for study, labels in studies.labels.items():
        for name, label in labels.items():
            found.setdefault(name, (label, printable_line(study)))
    return found


def _inside(runs_dir: Path) -> list[RunFolder]:
    """The runs in a folder, oldest first, but those that a link leads out of it to."""
    if not runs_dir.is_dir():
        return []
    root = runs_dir.resolve()
    found = [RunFolder(path.parent) for path in runs_dir.glob("*/config.toml")]
    inside = [folder for folder in found if folder.path.resolve().parent == root]
    return sorted(inside, key=lambda folder: (_changed(folder), folder.name))


def _has_config(folder: RunFolder) -> bool:
    """Whether a run has a config that can be read, or is being deleted."""
    try:
        folder.config()
    except (OSError, UserError):
        return not folder.config_file.is_file()
    return True


def _changed(folder: RunFolder) -> float:
    """When the run last recorded something, in seconds since the epoch."""
    for path in (folder.episodes, folder.config_file):
        try:
            return path.stat().st_mtime
        except OSError:
            continue
    return 0.0
