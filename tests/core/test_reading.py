import errno
import os
import socket
import tracemalloc
from pathlib import Path

import pytest

from touchdown.config import toml
from touchdown.core import files, reading, records
from touchdown.core.errors import UnreadableError, UserError


def refusal(path: Path, most: int | None = 10) -> str:
    with pytest.raises(UserError, match=r"^[^\n]*$") as said:
        reading.read_bytes(path, most)
    return str(said.value)


def test_bytes_are_read_up_to_what_they_may_be(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"four")
    assert reading.read_bytes(path, 4) == b"four"
    assert reading.read_bytes(path) == b"four"
    assert refusal(path, 3) == f"{path}: has 4 bytes, must be at most 3"
    assert (
        refusal(tmp_path / "gone") == f"{tmp_path}/gone: cannot be read: No such file or directory"
    )
    assert "cannot be read: " in refusal(Path("a\0b"))


@pytest.fixture(params=["pipe", "socket", "device", "folder"])
def irregular(request, tmp_path):
    """Something that is not a file, and what it is called."""
    path = tmp_path / "it"
    match request.param:
        case "pipe":
            os.mkfifo(path)
            return path, "is a named pipe, must be a regular file"
        case "socket":
            with socket.socket(socket.AF_UNIX) as listening:
                listening.bind(str(path))
            return path, "is a socket, must be a regular file"
        case "device":
            return Path("/dev/zero"), "is a device, must be a regular file"
        case _:
            path.mkdir()
            return path, "cannot be read: Is a directory"


def test_what_is_no_regular_file_is_refused_at_once_and_so_is_a_link_to_it(irregular, tmp_path):
    path, said = irregular
    link = tmp_path / "link"
    link.symlink_to(path)
    for each in (path, link):
        assert refusal(each, None) == f"{each}: {said}"
        for read in (
            lambda path: reading.check_regular(path, 10),
            lambda path: records.decode_json(path, dict),
            lambda path: records.decode_jsonl(path, dict),
            files.read_tensors,
            toml.read_toml,
        ):
            with pytest.raises(UserError, match=said):
                read(each)


def test_what_is_no_regular_file_is_not_appended_to_and_neither_is_the_end_of_a_link(
    irregular, tmp_path
):
    path, said = irregular
    (tmp_path / "mine").write_bytes(b"thesis")
    (tmp_path / "link").symlink_to("mine")
    (tmp_path / "to nothing").symlink_to("new")
    said = said.removeprefix("cannot be read: ")
    for each, why in (
        (path, said),
        (tmp_path / "link", "is a symbolic link, must be a regular file"),
        (tmp_path / "to nothing", "is a symbolic link, must be a regular file"),
    ):
        with pytest.raises((UserError, IsADirectoryError), match=why):
            reading.open_appendable(each)
    with pytest.raises(UnreadableError, match="link: is a symbolic link"):
        reading.read_bytes(tmp_path / "link", follow=False)
    assert (tmp_path / "mine").read_bytes() == b"thesis"
    assert not (tmp_path / "new").exists()


def test_a_file_is_read_and_appended_to_and_made_where_there_is_none(tmp_path):
    for line in (b"one\n", b"two\n"):
        with reading.open_appendable(tmp_path / "lines") as file:
            file.seek(0)
            file.write(line)
    assert reading.read_bytes(tmp_path / "lines", follow=False) == b"one\ntwo\n"


@pytest.mark.parametrize("number", [errno.EIO, errno.EMFILE, errno.EACCES])
def test_what_the_system_refuses_to_read_is_not_taken_for_missing(tmp_path, monkeypatch, number):
    def refuse(*_: object) -> int:
        raise OSError(number, os.strerror(number))

    (tmp_path / "a").write_bytes(b"whole")
    monkeypatch.setattr(reading.os, "open", refuse)
    with pytest.raises(UnreadableError, match=f"a: cannot be read: {os.strerror(number)}"):
        reading.read_bytes(tmp_path / "a")


def test_a_pipe_that_takes_the_place_of_a_file_does_not_block(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "file").write_bytes(b"")
    as_file = (tmp_path / "file").stat()
    monkeypatch.setattr(Path, "stat", lambda *_, **__: as_file)
    assert "is a named pipe, must be a regular file" in refusal(tmp_path / "pipe")


def test_a_link_to_a_file_is_read(tmp_path):
    (tmp_path / "file").write_bytes(b"four")
    (tmp_path / "link").symlink_to("file")
    assert reading.read_bytes(tmp_path / "link", 4) == b"four"
    assert reading.check_regular(tmp_path / "link", 4) == 4


def test_a_size_is_not_trusted():
    """Linux says that files in /proc are empty."""
    path = Path("/proc/self/status")
    assert path.stat().st_size == 0
    assert b"Name:" in reading.read_bytes(path, 100_000)
    assert refusal(path, 10) == f"{path}: has more than 10 bytes, must be at most 10"


def test_a_file_of_gigabytes_without_content_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "sparse.toml"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    tracemalloc.start()
    for read in (toml.read_toml, lambda path: records.decode_json(path, dict)):
        with pytest.raises(UserError, match="has 1099511627776 bytes, must be at most"):
            read(path)
    assert tracemalloc.get_traced_memory()[1] < 1e6
    tracemalloc.stop()


def test_text_must_be_utf_8(tmp_path):
    path = tmp_path / "a"
    path.write_bytes("ε".encode())
    assert reading.read_text(path, 9) == "ε"
    path.write_bytes(b"\xff")
    with pytest.raises(UserError, match="cannot be read: 'utf-8' codec can't decode"):
        reading.read_text(path, 9)
