"""The rows of a record as columns, and which of them a page has not been sent yet."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

MOST_ROWS = 100_000
"""Of one record that a page draws; of more, every second one is left out, again and again."""
CHUNK_ROWS = 5_000
"""In one message, so that a long record does not hold up the messages of other runs."""


class Position(NamedTuple):
    """How much of a record a page has been sent."""

    generation: int = -1
    rows: int = 0


class Columns:
    """The rows of one record by column; a row without a value has None there."""

    def __init__(self) -> None:
        self._values: dict[str, list[Any]] = {}
        self._rows = 0
        self._seen = 0
        self._stride = 1
        self._generation = 0

    def __len__(self) -> int:
        return self._rows

    def column(self, name: str) -> Sequence[Any]:
        """The values of one column, without a value where no row has one."""
        return self._values.get(name, ())

    def restart(self) -> None:
        """Forget all rows."""
        self._values = {}
        self._rows = self._seen = 0
        self._stride = 1
        self._generation += 1

    def extend(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Append rows, leaving some out where there are too many to be drawn."""
        for row in rows:
            if self._seen % self._stride == 0:
                for name in row:
                    if name not in self._values:
                        self._values[name] = [None] * self._rows
                for name, column in self._values.items():
                    column.append(row.get(name))
                self._rows += 1
            self._seen += 1
            if self._rows > MOST_ROWS:
                self._thin_out()

    def since(self, position: Position) -> Iterator[tuple[dict[str, Any], Position]]:
        """What a page lacks, in parts, each with the position after it.

        A part is a JSON object: `columns`, `stride`, which is the number of rows of the file for
        each that is kept, and `restart`, whether the page must forget the rows it has.
        """
        generation = self._generation
        start = position.rows if position.generation == generation else 0
        restart = position.generation != generation
        # rows may be appended, and thinned out, between two parts
        while generation == self._generation and (restart or start < self._rows):
            end = min(start + CHUNK_ROWS, self._rows)
            columns = {name: column[start:end] for name, column in self._values.items()}
            part = {"restart": restart, "stride": self._stride, "columns": columns}
            yield part, Position(generation, end)
            start, restart = end, False

    def _thin_out(self) -> None:
        self._values = {name: column[::2] for name, column in self._values.items()}
        self._rows = (self._rows + 1) // 2
        self._stride *= 2
        self._generation += 1
