"""Reads what is appended to a JSON Lines file, each line once."""

import os
from pathlib import Path
from typing import Generic, NamedTuple

from touchdown.core import reading
from touchdown.core.errors import UserError, one_line
from touchdown.core.records import Record, decode_lines

_MOST_BYTES = 1 << 22
"""In one reading, so that a long file does not hold up the others."""
_NO_FILE = (-1, -1)
_COMPARED_BYTES = 256
"""Before the position, which tell whether the file is still the one that was read."""


class Added(NamedTuple, Generic[Record]):
    """What one reading gave."""

    rows: list[Record]
    restarted: bool
    """Whether the file is another, or was cut: the rows read before no longer count."""
    is_all: bool
    """Whether these are all lines so far; if not, read again at once."""


class Tail(Generic[Record]):
    """Follows a JSON Lines file that a run appends to.

    A resumed run cuts its records back to the last checkpoint, and a run may be deleted and made
    again under the same name: then the file is read from the start.

    Args:
        path: the file; it may be missing.
        kind: the type of a line's record.
    """

    def __init__(self, path: Path, kind: type[Record]) -> None:
        self._path = path
        self._kind: type[Record] = kind
        self._file: tuple[int, int] | None = None
        self._position = 0
        self._lines = 0
        self._before = b""

    def read(self) -> Added[Record]:
        """The complete lines since the last reading; none while the file is missing.

        Raises:
            UserError: a line is damaged, or the path leads to something that is not a regular file.
                The next reading begins with the same line.
        """
        try:
            file = reading.open_regular(self._path)
        except FileNotFoundError:  # what was read stays, until there is another file
            if self._file is not None:
                self._file = _NO_FILE
            return Added([], restarted=False, is_all=True)
        except OSError as error:
            raise UserError(f"{self._path}: cannot be read: {one_line(error)}") from None
        with file:
            facts = os.fstat(file.fileno())
            restarted = self._file is not None and not self._continues(file.fileno(), facts)
            if restarted:
                self._forget()
            self._file = facts.st_dev, facts.st_ino
            data = os.pread(file.fileno(), _MOST_BYTES, self._position)
        whole = data[: data.rfind(b"\n") + 1]
        if not whole and len(data) == _MOST_BYTES:
            raise UserError(
                f"{self._path}: line {self._lines + 1}: has more than {_MOST_BYTES} bytes"
            )
        rows = decode_lines(whole, self._kind, self._path, self._lines + 1)
        self._position += len(whole)
        self._lines += len(rows)
        self._before = (self._before + whole)[-_COMPARED_BYTES:]
        return Added(rows, restarted, is_all=len(data) < _MOST_BYTES)

    def _continues(self, descriptor: int, facts: os.stat_result) -> bool:
        """Whether the file still begins with what was read."""
        if self._file != (facts.st_dev, facts.st_ino) or facts.st_size < self._position:
            return False
        start = self._position - len(self._before)
        return os.pread(descriptor, len(self._before), start) == self._before

    def _forget(self) -> None:
        self._file = None
        self._position = self._lines = 0
        self._before = b""
