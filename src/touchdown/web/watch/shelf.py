"""The runs that a server may show, found by keys that no path can be made of."""

import hashlib
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from touchdown.core.terminal import printable_line
from touchdown.runs.folder import RunFolder
from touchdown.web.watch.facts import status_of

_FRESH_SECONDS = 1.0
"""For which a listing is used again."""


@dataclass(frozen=True, slots=True)
class Shelved:
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


class Shelf:
    """The runs in a folder, those of the studies in it, and those that the user named.

    Requests name a run by its key, which is looked up here, so that no request can lead elsewhere.
    A folder that a symbolic link leads out of the runs' folder to is not on the shelf, unless the
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
        self._found: dict[str, Shelved] = {}
        self._until = 0.0

    def all(self) -> list[Shelved]:
        """Every run: first those that the user named, then the newest."""
        if time.monotonic() >= self._until:
            self._found = self._find()
            self._until = time.monotonic() + _FRESH_SECONDS
        return list(self._found.values())

    def find(self, key: str) -> Shelved | None:
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
                "status": status_of(run.folder),
                "changed": _changed(run.folder),
            }
            for run in self.all()
        ]
        return sorted(rows, key=lambda row: (row["status"] != "training", -row["changed"]))

    def _find(self) -> dict[str, Shelved]:
        found: dict[str, Shelved] = {}

        def add(folder: RunFolder, label: str, group: str = "") -> None:
            key = key_of(folder)
            found.setdefault(key, Shelved(key, folder, printable_line(label), group))

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


def _changed(folder: RunFolder) -> float:
    """When the run last recorded something, in seconds since the epoch."""
    for path in (folder.episodes, folder.config_file):
        try:
            return path.stat().st_mtime
        except OSError:
            continue
    return 0.0
