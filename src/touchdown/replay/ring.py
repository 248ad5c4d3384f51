"""A ring buffer: a first-in, first-out store of records."""

from typing import Any

import numpy as np

from touchdown.core.types import RecordArray


class Ring:
    """Keeps the newest `capacity` records of one dtype; a new record overwrites the oldest.

    Args:
        capacity: number of records, at least 1.
        dtype: dtype of a record.

    Raises:
        ValueError: the capacity is less than 1.
    """

    def __init__(self, capacity: int, dtype: np.dtype[np.void]) -> None:
        if capacity < 1:
            raise ValueError(f"capacity must be at least 1 record, got {capacity}")
        self._records: RecordArray = np.zeros(capacity, dtype)
        self._added = 0

    def __len__(self) -> int:
        return min(self._added, len(self._records))

    @property
    def capacity(self) -> int:
        """Largest number of records."""
        return len(self._records)

    @property
    def added(self) -> int:
        """Number of records ever appended, including overwritten ones."""
        return self._added

    @property
    def records(self) -> RecordArray:
        """The stored records, in storage order, not by age (a view)."""
        return self._records[: len(self)]

    @property
    def storage(self) -> RecordArray:
        """All memory for records, stored or not, [capacity] (no copy)."""
        return self._records

    def wrote(self, count: int) -> None:
        """Count records that the caller wrote to `storage`, each where `append` would have."""
        self._added += count

    def append(self, record: tuple[Any, ...]) -> None:
        """Store one record, given as a tuple of its fields."""
        self._records[self._added % len(self._records)] = record
        self._added += 1

    def restore(self, records: RecordArray, added: int) -> None:
        """Copy the `records` and the count `added` of another ring.

        Raises:
            ValueError: the dtype, the capacity or the count does not fit.
        """
        if records.dtype != self._records.dtype:
            raise ValueError(f"records are {records.dtype}, must be {self._records.dtype}")
        if len(records) != min(added, len(self._records)):
            raise ValueError(
                f"{len(records)} records, {added} added: do not fit a capacity of {self.capacity}"
            )
        self._records[: len(records)] = records
        self._added = added
