import errno
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from touchdown.core import files, records
from touchdown.core.errors import UserError, one_line


def disk_full(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def half_write(path: Path, data: bytes) -> int:
    with path.open("wb") as file:
        file.write(data[: len(data) // 2])
    raise OSError(errno.ENOSPC, "No space left on device")


# --- one file ---


@pytest.mark.parametrize(("data", "held"), [(b"\x00\xff", b"\x00\xff"), ("ε\n", "ε\n".encode())])
def test_write_atomic_writes_bytes_and_text_over_what_was_there(
    data: bytes | str, held: bytes, tmp_path: Path, no_temporaries: Callable[[], bool]
):
    path = tmp_path / "state.json"
    path.write_bytes(b"a longer content from before")
    files.write_atomic(path, data)
    assert path.read_bytes() == held
    assert no_temporaries()


@pytest.mark.parametrize("fails", ["write", "flush", "rename"])
def test_write_atomic_leaves_the_old_content_where_the_disk_is_full(
    fails: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    no_temporaries: Callable[[], bool],
):
    path = tmp_path / "state.json"
    path.write_bytes(b"old")
    with monkeypatch.context() as patch:
        match fails:
            case "write":
                patch.setattr(Path, "write_bytes", half_write)
            case "flush":
                patch.setattr(files.os, "fsync", disk_full)
            case _:
                patch.setattr(Path, "replace", disk_full)
        with pytest.raises(OSError, match="No space left"):
            files.write_atomic(path, b"new and longer")
    assert path.read_bytes() == b"old"
    assert no_temporaries()


def test_write_atomic_leaves_nothing_where_a_first_write_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", half_write)
        with pytest.raises(OSError, match="No space left"):
            files.write_atomic(tmp_path / "state.json", b"new")
    assert list(tmp_path.iterdir()) == []


def test_write_atomic_leaves_the_old_content_where_it_is_interrupted(
    tmp_path: Path, no_temporaries: Callable[[], bool]
):
    def interrupt(temporary: Path) -> None:
        temporary.write_text("half")
        raise KeyboardInterrupt

    path = tmp_path / "state.json"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt):
        files.write_through(path, interrupt)
    assert path.read_text() == "old"
    assert no_temporaries()


def test_readers_see_the_old_file_whole_until_the_new_one_is_whole(tmp_path: Path):
    path = tmp_path / "plot.png"
    path.write_text("old")
    seen: list[str] = []

    def write(temporary: Path) -> None:
        temporary.write_text("ne")
        seen.append(path.read_text())
        seen.append(temporary.suffix)  # picture writers go by it
        assert temporary.parent == path.parent  # a rename across file systems would not be atomic
        temporary.write_text("new")

    files.write_through(path, write)
    assert seen == ["old", ".png"]
    assert path.read_text() == "new"


# --- a folder ---


def test_a_folder_appears_with_all_its_files(tmp_path: Path, no_temporaries: Callable[[], bool]):
    path = tmp_path / "000010"

    def write(folder: Path) -> None:
        (folder / "a").write_text("1")
        assert not path.exists()
        (folder / "b").write_text("2")

    files.write_folder_atomic(path, write)
    assert {file.name: file.read_text() for file in path.iterdir()} == {"a": "1", "b": "2"}
    assert no_temporaries()


def test_a_folder_that_cannot_be_finished_never_appears(tmp_path: Path):
    def write(folder: Path) -> None:
        (folder / "a").write_text("1")
        disk_full()

    with pytest.raises(OSError, match="No space left"):
        files.write_folder_atomic(tmp_path / "000010", write)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_there_already_stays_as_it_was(
    tmp_path: Path, no_temporaries: Callable[[], bool]
):
    path = tmp_path / "000010"
    files.write_folder_atomic(path, lambda folder: (folder / "a").write_text("old"))
    with pytest.raises(FileExistsError):
        files.write_folder_atomic(path, lambda folder: (folder / "b").write_text("new"))
    assert [file.name for file in path.iterdir()] == ["a"]
    assert no_temporaries()


def test_what_a_killed_writer_left_is_not_part_of_the_next_folder(tmp_path: Path):
    path = tmp_path / "000010"
    leftovers: list[Path] = []

    def die(folder: Path) -> None:
        (folder / "stale").write_text("1")
        leftovers.append(folder)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        files.write_folder_atomic(path, die)
    leftovers[0].mkdir()  # as after a kill, which runs no clean-up
    (leftovers[0] / "stale").write_text("1")
    files.write_folder_atomic(path, lambda folder: (folder / "fresh").write_text("2"))
    assert [file.name for file in path.iterdir()] == ["fresh"]


# --- leftovers ---


def test_remove_temporaries_takes_what_killed_writers_left_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    with monkeypatch.context() as patch:  # a kill runs no clean-up
        patch.setattr(Path, "unlink", lambda *_, **__: None)
        patch.setattr(files.shutil, "rmtree", lambda *_, **__: None)
        patch.setattr(files.os, "fsync", disk_full)
        with pytest.raises(OSError, match="No space left"):
            files.write_atomic(tmp_path / "state.json", b"half")
        with pytest.raises(OSError, match="No space left"):
            files.write_folder_atomic(tmp_path / "ten", lambda at: (at / "a").write_text("half"))
    assert len(list(tmp_path.iterdir())) == 2
    kept = ["state.json", ".hidden", "notes.tmp", "folder"]
    for name in kept[:-1]:
        (tmp_path / name).write_text("mine")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / ".deeper.1.tmp").write_text("in a folder that was not named")

    files.remove_temporaries([tmp_path, tmp_path / "not there"])

    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(kept)
    assert (tmp_path / "folder" / ".deeper.1.tmp").exists()


# --- reading JSON ---


def read_json(path: Path) -> dict[str, Any]:
    return records.decode_json(path, dict[str, Any])


def test_a_json_file_gives_its_object(tmp_path: Path):
    (tmp_path / "a.json").write_text(files.to_json({"ε": 0.5, "n": [1, 2]}), "utf-8")
    assert read_json(tmp_path / "a.json") == {"ε": 0.5, "n": [1, 2]}


@pytest.mark.parametrize(
    ("content", "named"),
    [
        (b'{"seed": 1', "not JSON"),
        (b"", "not JSON"),
        (b"\xff\xfe{}", "not JSON"),
        (b"[1, 2]", "is of type list"),
        (b"null", "is of type NoneType"),
    ],
)
def test_a_json_file_without_an_object_is_refused_by_its_name(
    content: bytes, named: str, tmp_path: Path
):
    path = tmp_path / "a.json"
    path.write_bytes(content)
    with pytest.raises(UserError, match=named) as refusal:
        read_json(path)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_json_or_json_lines_file_that_is_not_there_is_named(tmp_path: Path):
    for read in (read_json, files.read_jsonl):
        with pytest.raises(UserError, match=r"none\.json: cannot be read"):
            read(tmp_path / "none.json")


def test_to_json_refuses_numbers_that_json_does_not_have():
    with pytest.raises(ValueError, match="JSON"):
        files.to_json({"loss": float("nan")})
    assert files.to_json({"a": 1}).endswith("}\n")


# --- reading JSON Lines ---


@pytest.mark.parametrize("unfinished", [b"", b'{"episode": 2', b'{"episode": 2}'])
def test_read_jsonl_ignores_a_last_line_that_is_still_being_written(
    unfinished: bytes, tmp_path: Path
):
    path = tmp_path / "episodes.jsonl"
    path.write_bytes(b'{"episode": 0}\n{"episode": 1}\n' + unfinished)
    assert files.read_jsonl(path) == [{"episode": 0}, {"episode": 1}]


@pytest.mark.parametrize("broken", ['{"episode": 1', "[1]", "", "nonsense"])
def test_read_jsonl_refuses_a_broken_whole_line_by_its_number(broken: str, tmp_path: Path):
    path = tmp_path / "episodes.jsonl"
    path.write_text(f'{{"episode": 0}}\n{broken}\n{{"episode": 2}}\n')
    with pytest.raises(UserError, match="line 2 is not a JSON object") as refusal:
        files.read_jsonl(path)
    assert str(path) in str(refusal.value)


def test_read_jsonl_of_an_empty_file_has_no_rows(tmp_path: Path):
    (tmp_path / "episodes.jsonl").write_text("")
    assert files.read_jsonl(tmp_path / "episodes.jsonl") == []


def test_read_jsonl_gives_back_any_text_that_json_writes(tmp_path: Path):
    rows = [{"note": "ε, tab\t, line\nbreak"}, {"note": "{}"}]
    path = tmp_path / "rows.jsonl"
    path.write_text("".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows), "utf-8")
    assert files.read_jsonl(path) == rows


def test_one_line_puts_a_message_on_one_line_and_falls_back_on_the_type():
    assert one_line(ValueError("two\n  lines")) == "two lines"
    assert one_line(MemoryError()) == "MemoryError"


def test_a_line_cut_inside_a_character_is_unfinished_and_odd_separators_are_text(tmp_path: Path):
    path = tmp_path / "rows.jsonl"
    path.write_bytes(b'{"a": 1}\n{"\xce')
    assert files.read_jsonl(path) == [{"a": 1}]
    path.write_text('{"a": "x\u2028y\u0085z"}\n', "utf-8")
    assert files.read_jsonl(path) == [{"a": "x\u2028y\u0085z"}]


def test_nesting_beyond_reason_is_refused_in_one_line(tmp_path: Path):
    path = tmp_path / "deep.json"
    path.write_text("[" * 100_000)
    with pytest.raises(UserError, match="not JSON"):
        read_json(path)
