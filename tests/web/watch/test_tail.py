import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchdown.core.errors import UserError
from touchdown.core.records import decode_jsonl
from touchdown.web.watch import tail
from touchdown.web.watch.tail import Added, Tail


def lines(*values: int) -> bytes:
    return b"".join(json.dumps({"n": value}).encode() + b"\n" for value in values)


def numbers(added: Added[dict[str, int]]) -> list[int]:
    return [row["n"] for row in added.rows]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "records.jsonl"


@pytest.fixture
def followed(path: Path) -> Tail[dict[str, int]]:
    return Tail(path, dict[str, int])


def add(path: Path, data: bytes) -> None:
    with path.open("ab") as file:
        file.write(data)


def test_a_missing_file_has_no_lines_until_it_is_there(path, followed):
    assert followed.read() == Added([], restarted=False, is_all=True)
    add(path, lines(1))
    assert numbers(followed.read()) == [1]


@given(st.lists(st.integers(0, 99), max_size=30), st.data())
def test_lines_in_any_pieces_are_read_once_each(tmp_path_factory, values, data):
    path = tmp_path_factory.mktemp("tail") / "records.jsonl"
    whole = lines(*values)
    cuts = data.draw(st.lists(st.integers(0, len(whole)), max_size=8).map(sorted))
    followed, found = Tail(path, dict[str, int]), []
    for start, end in zip([0, *cuts], [*cuts, len(whole)], strict=True):
        add(path, whole[start:end])
        added = followed.read()
        assert not added.restarted
        found += added.rows
    assert found == decode_jsonl(path, dict[str, int])


def test_a_file_that_a_resumed_run_cut_is_read_from_the_start(path, followed):
    add(path, lines(1, 2, 3))
    followed.read()
    path.write_bytes(lines(1))
    assert followed.read() == Added([{"n": 1}], restarted=True, is_all=True)


def test_a_file_that_was_cut_and_has_grown_again_is_read_from_the_start(path, followed):
    add(path, lines(1, 2, 3))
    followed.read()
    with path.open("r+b") as file:  # the same file
        file.truncate(len(lines(1)))
    add(path, lines(5, 6, 7))
    added = followed.read()
    assert added.restarted
    assert numbers(added) == [1, 5, 6, 7]


def test_a_run_that_was_deleted_and_made_again_is_read_from_the_start(path, followed):
    add(path, lines(1, 2))
    followed.read()
    path.unlink()
    assert followed.read() == Added([], restarted=False, is_all=True)  # what was read stays
    assert not followed.read().restarted
    add(path, lines(1, 2, 3))
    assert numbers(followed.read()) == [1, 2, 3]


def test_a_damaged_line_is_named_again_and_again_and_not_skipped(path, followed):
    add(path, lines(1) + b'{"n": "x"}\n' + lines(3))
    for _ in range(2):
        with pytest.raises(UserError, match=r"records\.jsonl: line 2: n = 'x'"):
            followed.read()
    path.write_bytes(lines(1, 2, 3))
    assert numbers(followed.read()) == [1, 2, 3]


def test_the_number_of_a_damaged_line_counts_those_read_before(path, followed):
    add(path, lines(1, 2))
    followed.read()
    add(path, b"nothing\n")
    with pytest.raises(UserError, match="line 3 is not a JSON object"):
        followed.read()


def test_a_long_file_is_read_in_parts(path, followed, monkeypatch):
    monkeypatch.setattr(tail, "_MOST_BYTES", 2 * len(lines(1)) + 1)
    add(path, lines(1, 2, 3))
    first = followed.read()
    assert (numbers(first), first.is_all) == ([1, 2], False)
    second = followed.read()
    assert (numbers(second), second.is_all) == ([3], True)


def test_a_line_without_end_is_refused(path, followed, monkeypatch):
    monkeypatch.setattr(tail, "_MOST_BYTES", 16)
    add(path, b"x" * 100)
    with pytest.raises(UserError, match="line 1: has more than 16 bytes"):
        followed.read()


def test_a_link_is_not_followed(path, followed, tmp_path):
    secret = tmp_path / "secret"
    secret.write_bytes(lines(1))
    path.symlink_to(secret)
    with pytest.raises(UserError, match="is a symbolic link, must be a regular file"):
        followed.read()
