"""Logs of a training run: JSON Lines, and the same numbers for TensorBoard."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, cast

from tensorboardX.event_file_writer import EventsWriter
from tensorboardX.proto import event_pb2
from tensorboardX.summary import scalar  # pyright: ignore[reportUnknownVariableType]

from touchdown.core import files
from touchdown.runs.folder import RunFolder
from touchdown.runs.rows import EpisodeRow, UpdateRow, ValidationRow

_EVENTS = "events.out.tfevents.*"


class Recorder:
    """Appends to a run's records and flushes each complete line.

    Args:
        folder: the run's folder.
        sizes: size of each record in bytes at the checkpoint that the run resumes from. Later bytes
            are removed, because training writes them again. Empty for a new run.
    """

    def __init__(self, folder: RunFolder, sizes: Mapping[str, int]) -> None:
        self._folder = folder.path
        events_kept = _cut_events(folder.path, sizes)
        self._lines: dict[str, BinaryIO] = {}
        for path in (folder.episodes, folder.updates, folder.validations):
            file = path.open("ab")
            file.truncate(sizes.get(path.name, 0))
            file.seek(0, 2)
            self._lines[path.name] = file
        # the suffix prevents a run resumed within a second from overwriting its own file
        self._events_suffix = f".{events_kept}"
        self._events: EventsWriter | None = None  # created when there is something to write

    def write(
        self,
        path: Path,
        row: EpisodeRow | UpdateRow | ValidationRow,
        scalars: Mapping[str, float],
    ) -> None:
        """Append one line, and its numbers for TensorBoard.

        Args:
            path: one of the folder's JSON Lines files.
            row: the line.
            scalars: values by TensorBoard tag, at step `row.env_steps`.
        """
        file = self._lines[path.name]
        file.write(files.to_json_line(row.to_json() if isinstance(row, UpdateRow) else row))
        file.flush()
        if self._events is None:
            self._events = EventsWriter(str(self._folder / "events"), self._events_suffix)
        for tag, value in scalars.items():
            event = cast(Any, event_pb2).Event(wall_time=time.time(), step=row.env_steps)
            event.summary.MergeFrom(scalar(tag, value))
            self._events.write_event(event)

    def sizes(self) -> dict[str, int]:
        """Bytes written to each record so far, flushed, for a checkpoint."""
        if self._events is not None:
            self._events.flush()
        paths = [self._folder / name for name in self._lines]
        paths += self._folder.glob(_EVENTS)
        return {path.name: path.stat().st_size for path in paths}

    def close(self) -> None:
        """Flush and close."""
        for file in self._lines.values():
            file.close()
        if self._events is not None:
            self._events.close()


def _cut_events(folder: Path, sizes: Mapping[str, int]) -> int:
    kept = 0
    for path in sorted(folder.glob(_EVENTS)):
        if path.name in sizes:
            with path.open("ab") as file:
                file.truncate(sizes[path.name])
            kept += 1
        else:
            path.unlink()
    return kept
