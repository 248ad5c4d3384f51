import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchdown.web.watch import columns
from touchdown.web.watch.columns import Columns, Position


class Reader:
    """A page, which puts parts together."""

    def __init__(self) -> None:
        self.position = Position()
        self.values: dict[str, list[object]] = {}
        self.stride = 0

    def read(self, record: Columns) -> None:
        for part, position in record.since(self.position):
            self.position = position
            if part["restart"]:
                self.values = {}
            self.stride = part["stride"]
            for name, values in part["columns"].items():
                self.values.setdefault(name, []).extend(values)


@given(st.lists(st.tuples(st.integers(0, 9), st.booleans()), max_size=20))
def test_a_page_has_all_rows_once_whatever_its_pace(steps):
    record, page = Columns(), Reader()
    expected: list[int] = []
    for count, reads in steps:
        new = list(range(len(expected), len(expected) + count))
        record.extend([{"n": value} for value in new])
        expected += new
        if reads:
            page.read(record)
    page.read(record)
    assert page.values.get("n", []) == expected


def test_long_records_are_sent_in_parts(monkeypatch):
    monkeypatch.setattr(columns, "CHUNK_ROWS", 2)
    record, page = Columns(), Reader()
    record.extend([{"n": value} for value in range(5)])
    assert len(list(record.since(Position()))) == 3
    page.read(record)
    assert page.values == {"n": [0, 1, 2, 3, 4]}


def test_a_page_that_reads_while_rows_are_left_out_gets_the_rows_that_are_left(monkeypatch):
    monkeypatch.setattr(columns, "MOST_ROWS", 4)
    monkeypatch.setattr(columns, "CHUNK_ROWS", 2)
    record, page = Columns(), Reader()
    record.extend([{"n": value} for value in range(4)])
    parts = record.since(Position())
    _, page.position = next(parts)
    record.extend([{"n": 4}])  # between two parts
    assert list(parts) == []
    page.read(record)
    assert page.values == {"n": [0, 2, 4]}


def test_a_row_without_a_value_has_none_there():
    record, page = Columns(), Reader()
    record.extend([{"a": 1}, {"b": 2}, {"a": 3, "b": 4}])
    page.read(record)
    assert page.values == {"a": [1, None, 3], "b": [None, 2, 4]}


def test_a_restart_reaches_pages_even_without_new_rows():
    record, page = Columns(), Reader()
    record.extend([{"n": 1}])
    page.read(record)
    record.restart()
    page.read(record)
    assert page.values == {}


@pytest.mark.parametrize(("rows", "kept", "stride"), [(4, [0, 1, 2, 3], 1), (11, [0, 4, 8], 4)])
def test_of_too_many_rows_every_second_is_left_out_again_and_again(monkeypatch, rows, kept, stride):
    monkeypatch.setattr(columns, "MOST_ROWS", 4)
    record, page = Columns(), Reader()
    for value in range(rows):
        record.extend([{"n": value}])
        page.read(record)
    assert page.values == {"n": kept}
    assert page.stride == stride
    assert len(record) == len(kept)
