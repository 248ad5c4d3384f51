"""Loggers that write files: JSON Lines and TensorBoard, and a run's own records.

A logger is a `Listener`: an object with `log(step, scalars)` and `close()`.
"""

import hashlib
import os
import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from tensorboardX.event_file_writer import EventsWriter
from tensorboardX.proto import event_pb2
from tensorboardX.summary import scalar  # pyright: ignore[reportUnknownVariableType]

from touchdown.core import files, limits, reading
from touchdown.core.errors import UserError
from touchdown.runs.folder import RunFolder
from touchdown.runs.rows import EpisodeRow, UpdateRow, ValidationRow
from touchdown.runs.training_flights import TrainingFlightRow

_EVENTS = "events.out.tfevents.*"


@dataclass(frozen=True, slots=True)
class Saved:
    """How much of each of a run's records a checkpoint names."""

    sizes: dict[str, int] = field(default_factory=dict[str, int])
    """Size of each record in bytes, by file name."""
    sha256: dict[str, str] = field(default_factory=dict[str, str])
    """SHA-256 of these bytes of each JSON Lines record, by file name; TensorBoard's events are
    only a copy."""

    def check(self, folder: Path) -> None:
        """Refuse records that are shorter or other than when they were saved.

        Args:
            folder: the run's folder.

        Raises:
            UnreadableError: a JSON Lines record cannot be read.
            UserError: one was altered.
        """
        for name, size in self.sizes.items():
            if not name.endswith(".jsonl"):
                continue
            path = folder / name
            data = b""
            if os.path.lexists(path):
                data = reading.read_bytes(path, limits.RECORD_BYTES, follow=False)[:size]
            if len(data) < size:
                raise UserError(f"{path}: altered; it is shorter than its checkpoint says")
            if name in self.sha256 and hashlib.sha256(data).hexdigest() != self.sha256[name]:
                raise UserError(
                    f"{path}: altered since its checkpoint was written (its SHA-256 differs)"
                )


class JsonLinesLogger:
    """Writes scalars to a JSON Lines file: one line `{"step": ..., tag: value, ...}` per call.

    Args:
        path: the file; if it exists, lines are appended.

    Raises:
        UserError: the file cannot be written.
    """

    def __init__(self, path: Path | str) -> None:
        with files.refusing(f"path {str(path)!r}"):
            self._file = Path(path).open("ab")  # noqa: SIM115 - open until it is closed

    def log(self, step: int, scalars: Mapping[str, float]) -> None:
        """Append one complete line, and flush it."""
        self._file.write(files.to_json_line({"step": step, **scalars}))
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class TensorBoardLogger:
    """Writes scalars to a new TensorBoard event file, created at the first call of `log`.

    Args:
        folder: folder of the file; created if it does not exist.
        suffix: suffix of the file's name, which contains the time in seconds and the host; needed
            if two writers may start in the same folder within a second.
    """

    def __init__(self, folder: Path | str, suffix: str = "") -> None:
        self._folder = Path(folder)
        self._suffix = suffix
        self._events: EventsWriter | None = None  # created when there is something to write

    def log(self, step: int, scalars: Mapping[str, float]) -> None:
        """Write one event per scalar."""
        if self._events is None:
            self._folder.mkdir(parents=True, exist_ok=True)
            self._events = EventsWriter(str(self._folder / "events"), self._suffix)
        for tag, value in scalars.items():
            event = cast(Any, event_pb2).Event(wall_time=time.time(), step=step)
            event.summary.MergeFrom(scalar(tag, value))
            self._events.write_event(event)

    def flush(self) -> None:
        """Flush to disk."""
        if self._events is not None:
            self._events.flush()

    def close(self) -> None:
        """Flush and close."""
        if self._events is not None:
            self._events.close()


class Recorder:
    """A run's own records: typed lines in its JSON Lines files, and TensorBoard events.

    It is a listener; a resumed run continues its files without gaps or repetitions.

    Args:
        folder: the run's folder.
        sizes: size of each record in bytes at the checkpoint that the run resumes from. Later bytes
            are removed, because training writes them again. Empty for a new run.
        flights: whether `training-flights.jsonl` is one of the records.

    Raises:
        OSError: a record cannot be written.
        UserError: one is not a regular file; no line of the others was removed.
    """

    def __init__(
        self, folder: RunFolder, sizes: Mapping[str, int], *, flights: bool = False
    ) -> None:
        self._folder = folder.path
        paths = [folder.episodes, folder.updates, folder.validations]
        if flights or folder.training_flights.name in sizes:
            paths.append(folder.training_flights)
        # all are opened before the first is changed
        with ExitStack() as opened:
            self._lines = {
                path.name: opened.enter_context(reading.open_appendable(path)) for path in paths
            }
            events_kept = _cut_events(folder.path, sizes)
            opened.pop_all()
        self._hashes: dict[str, Any] = {}
        for name, file in self._lines.items():
            file.truncate(sizes.get(name, 0))
            file.seek(0)
            self._hashes[name] = hashlib.file_digest(file, "sha256")
            file.seek(0, os.SEEK_END)
        files.sync(folder.path)  # the names of new files
        # the suffix prevents a run that resumes within a second from overwriting its own file
        self._events = TensorBoardLogger(folder.path, f".{events_kept}")

    def write(
        self, path: Path, row: EpisodeRow | UpdateRow | ValidationRow | TrainingFlightRow
    ) -> None:
        """Append one complete line, and flush it.

        Args:
            path: one of the folder's JSON Lines files.
            row: the line.
        """
        file = self._lines[path.name]
        line = files.to_json_line(row.to_json() if isinstance(row, UpdateRow) else row)
        self._hashes[path.name].update(line)
        file.write(line)
        file.flush()

    def log(self, step: int, scalars: Mapping[str, float]) -> None:
        """Write scalars for TensorBoard."""
        self._events.log(step, scalars)

    def saved(self) -> Saved:
        """What was written to each record so far, now flushed to the disk, for a checkpoint.

        Raises:
            OSError: it cannot be flushed.
        """
        self._events.flush()
        for file in self._lines.values():
            files.flush(file.fileno())
        paths = [self._folder / name for name in self._lines]
        paths += self._folder.glob(_EVENTS)
        return Saved(
            {path.name: path.stat().st_size for path in paths},
            {name: of.hexdigest() for name, of in self._hashes.items()},
        )

    def close(self) -> None:
        """Flush and close."""
        for file in self._lines.values():
            file.close()
        self._events.close()


def _cut_events(folder: Path, sizes: Mapping[str, int]) -> int:
    kept = 0
    for path in sorted(folder.glob(_EVENTS)):
        if path.name in sizes:
            with reading.open_appendable(path) as file:
                file.truncate(min(sizes[path.name], os.fstat(file.fileno()).st_size))
            kept += 1
        else:
            path.unlink()
    return kept
