import errno
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
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


# --- links, devices and pipes ---


def test_a_link_stays_and_its_target_is_replaced(tmp_path: Path):
    (tmp_path / "other").mkdir()
    target = tmp_path / "other" / "real.toml"
    (tmp_path / "near.toml").symlink_to("far.toml")
    (tmp_path / "far.toml").symlink_to(target)
    for content in ("new", "newer"):  # a link to nothing, then to a file
        files.write_atomic(tmp_path / "near.toml", content)
        assert target.read_text() == content
    assert (tmp_path / "near.toml").is_symlink()
    assert [path.name for path in target.parent.iterdir()] == ["real.toml"]


def test_links_that_go_round_in_a_circle_are_refused(tmp_path: Path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(OSError, match="Too many levels of symbolic links"):
        files.write_atomic(tmp_path / "a", "x")


def test_a_device_is_written_into_and_stays_a_device(tmp_path: Path):
    (tmp_path / "null").symlink_to("/dev/null")
    for path in (tmp_path / "null", Path("/dev/null")):
        files.write_atomic(path, "gone")
    with pytest.raises(OSError, match="No space left on device"):
        files.write_atomic(Path("/dev/full"), "x")
    assert all(Path(name).is_char_device() for name in ("/dev/null", "/dev/full"))
    assert [path.name for path in tmp_path.iterdir()] == ["null"]


def test_a_pipe_passes_the_bytes_on_and_one_without_a_reader_is_refused(tmp_path: Path):
    pipe = tmp_path / "pipe.gif"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="No such device or address"):
        files.write_atomic(pipe, "nobody listens")
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    files.write_through(pipe, lambda temporary: temporary.with_suffix(".gif").write_bytes(b"film"))
    assert os.read(reader, 9) == b"film"
    os.close(reader)
    assert pipe.is_fifo()


@pytest.mark.parametrize("names", ["/proc/self/fd", "/dev/fd"])
def test_an_open_file_is_written_where_it_stands(tmp_path: Path, names: str):
    if not Path(names).is_dir():
        pytest.skip("this system does not name open files there")
    with (tmp_path / "printed").open("w+b", buffering=0) as printed:
        printed.write(b"before ")
        (tmp_path / "stdout").symlink_to(f"{names}/{printed.fileno()}")
        files.write_atomic(tmp_path / "stdout", "the file ")
        printed.write(b"after")
        printed.seek(0)
        assert printed.read() == b"before the file after"


def test_a_folder_is_never_replaced_by_a_file(tmp_path: Path):
    (tmp_path / "runs").mkdir()
    with pytest.raises(IsADirectoryError):
        files.write_atomic(tmp_path / "runs", "x")
    assert (tmp_path / "runs").is_dir()


def test_a_private_file_stays_private_and_a_long_name_has_room(tmp_path: Path):
    path = tmp_path / ("ε" * 120 + ".toml")
    files.write_atomic(path, "first")
    path.chmod(0o600)
    files.write_atomic(path, "second")
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_private_file_is_private_while_it_is_written_and_a_read_only_one_is_replaced(
    tmp_path: Path,
):
    path = tmp_path / "a"
    path.write_text("old")
    for mode in (0o600, 0o400):
        path.chmod(mode)
        seen: list[int] = []

        def write(temporary: Path, seen: list[int] = seen) -> None:
            seen.append(temporary.stat().st_mode & 0o777)
            temporary.write_text("new")

        files.write_through(path, write)
        assert (seen, path.stat().st_mode & 0o777) == ([0o600], mode)


def test_a_file_of_a_run_replaces_a_link_and_a_pipe_that_are_in_its_place(tmp_path: Path):
    (tmp_path / "thesis").write_text("mine")
    (tmp_path / "curve.png").symlink_to("thesis")
    os.mkfifo(tmp_path / "flight.gif")
    for name in ("curve.png", "flight.gif"):
        files.write_atomic(tmp_path / name, "picture", follow=False)
        assert (tmp_path / name).read_text() == "picture"
        assert not (tmp_path / name).is_symlink()
    assert (tmp_path / "thesis").read_text() == "mine"
    (tmp_path / "folder").mkdir()
    with pytest.raises(IsADirectoryError):
        files.write_atomic(tmp_path / "folder", "x", follow=False)


def test_a_folder_whose_names_may_not_be_read_takes_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    opened = os.open

    def refuse(path: Path, *rest: Any) -> int:
        if path == tmp_path:
            raise PermissionError(errno.EACCES, "Permission denied")
        return opened(path, *rest)

    monkeypatch.setattr(files.os, "open", refuse)
    files.write_atomic(tmp_path / "a", "written")
    assert (tmp_path / "a").read_text() == "written"


# --- safetensors ---


def test_the_same_arrays_and_metadata_give_the_same_bytes(tmp_path: Path):
    tensors = {"b": np.zeros((2, 3), np.float32), "a": np.arange(3)}
    metadata = dict.fromkeys("hgfedcba", "ε")
    data = {files.to_safetensors(tensors, metadata) for _ in range(20)}
    assert len(data) == 1
    path = tmp_path / "x.safetensors"
    path.write_bytes(data.pop())
    found, texts = files.read_tensors(path)
    assert texts == metadata
    assert (found["a"].tolist(), found["b"].shape) == ([0, 1, 2], (2, 3))


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


def test_a_folder_is_complete_or_as_it_was(tmp_path):
    out = tmp_path / "new" / "out"
    with files.complete_folder(out) as folder:
        (folder / "inside").mkdir()
        (folder / "inside" / "a").write_text("1")
        assert not out.exists()
    (out / "mine").write_text("kept")
    for failure, said in (
        (lambda folder: UserError(f"{folder}/b: cannot be written"), f"{out}/b: cannot be written"),
        (lambda _: OSError("Disk full"), f"out '{out}': cannot be written: Disk full"),
    ):
        assert broken_off(out, failure) == said
    assert sorted(path.name for path in out.rglob("*")) == ["a", "inside", "mine"]
    with files.complete_folder(out) as folder:
        (folder / "inside").mkdir()
        (folder / "inside" / "a").write_text("3")
    assert (out / "inside" / "a").read_text() == "3"
    assert (out / "mine").read_text() == "kept"
    assert sorted(path.name for path in out.parent.rglob("*")) == ["a", "inside", "mine", "out"]


def broken_off(out: Path, failure: Callable[[Path], Exception]) -> str:
    """The error of a block that fails after it has written a file."""
    with pytest.raises(UserError) as said, files.complete_folder(out) as folder:  # noqa: PT012
        (folder / "b").write_text("2")
        raise failure(folder)
    return str(said.value)
