from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchdown.replay.ring import Ring

DTYPE = np.dtype([("time", np.int32), ("pair", np.float32, (2,))])


def record(time: int) -> tuple[int, tuple[float, float]]:
    return time, (time + 0.25, -time)


def filled(capacity: int, count: int) -> Ring:
    ring = Ring(capacity, DTYPE)
    for time in range(count):
        ring.append(record(time))
    return ring


def by_age(ring: Ring) -> list[int]:
    return sorted(ring.records["time"].tolist())


@given(capacity=st.integers(1, 12), count=st.integers(0, 40))
def test_a_ring_keeps_what_a_bounded_deque_keeps(capacity: int, count: int):
    ring = Ring(capacity, DTYPE)
    twin: deque[int] = deque(maxlen=capacity)
    for time in range(count):
        ring.append(record(time))
        twin.append(time)
        assert by_age(ring) == list(twin)
        assert len(ring) == len(twin)
    assert ring.added == count
    assert ring.capacity == capacity


def test_every_field_of_a_record_is_stored():
    ring = filled(3, 5)
    for row in ring.records:
        time, pair = record(int(row["time"]))
        assert row["time"] == time
        assert row["pair"].tolist() == list(pair)


@given(capacity=st.integers(1, 8), before=st.integers(0, 20), after=st.integers(0, 20))
def test_a_restored_ring_goes_on_identically(capacity: int, before: int, after: int):
    ring = filled(capacity, before)
    restored = Ring(capacity, DTYPE)
    restored.restore(ring.records.copy(), ring.added)
    for time in range(before, before + after):
        ring.append(record(time))
        restored.append(record(time))
    assert np.array_equal(restored.records, ring.records)  # in storage order, which sampling draws
    assert restored.added == ring.added


def test_a_restored_ring_shares_no_memory_with_what_it_came_from():
    ring, records = Ring(2, DTYPE), np.array([record(0), record(1)], DTYPE)
    ring.restore(records, 2)
    ring.append(record(9))
    assert records["time"].tolist() == [0, 1]


def test_restore_refuses_records_of_another_dtype():
    other = np.dtype([("time", np.int64), ("pair", np.float32, (2,))])
    ring = filled(4, 2)
    with pytest.raises(ValueError, match=r"records are .*must be"):
        ring.restore(np.zeros(2, other), 2)
    assert by_age(ring) == [0, 1]


@pytest.mark.parametrize(
    ("held", "added"),
    [
        (3, 2),  # more than were added
        (1, 2),  # fewer than were added
        (3, 9),  # of a smaller memory, which had overflowed
        (5, 5),  # of a larger memory
    ],
)
def test_restore_refuses_a_count_that_does_not_fill_the_memory(held: int, added: int):
    ring = filled(4, 2)
    with pytest.raises(ValueError, match=f"{held} records, {added} added"):
        ring.restore(np.zeros(held, DTYPE), added)
    assert by_age(ring) == [0, 1]
    assert ring.added == 2


@pytest.mark.parametrize("capacity", [0, -1])
def test_a_ring_without_room_is_refused(capacity: int):
    with pytest.raises(ValueError, match=f"at least 1 record, got {capacity}"):
        Ring(capacity, DTYPE)


def test_records_written_to_the_storage_count_like_those_appended():
    appended, written = filled(3, 4), filled(3, 2)
    for time in (2, 3):
        written.storage[time % 3] = record(time)
    written.wrote(2)
    assert written.added == appended.added
    np.testing.assert_array_equal(written.records, appended.records)
