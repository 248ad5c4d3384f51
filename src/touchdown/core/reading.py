"""Reads regular files, and nothing else: no pipe blocks, and no device is read for ever."""

import os
import stat
from io import BufferedRandom, BufferedReader
from pathlib import Path

from touchdown.core.errors import UnreadableError, UserError, one_line

_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFLNK: "a symbolic link",
}
# a pipe that takes the file's place after the first check does not block, nor does a terminal
# become the controlling one
_FLAGS = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)


def read_bytes(path: Path, most: int | None = None, *, follow: bool = True) -> bytes:
    """The bytes of a regular file, or of one that a link leads to.

    Args:
        path: the file.
        most: largest number of bytes; None accepts any size.
        follow: whether a link may lead to the file.

    Raises:
        UnreadableError: it is not a regular file, or is there and cannot be read.
        UserError: it is missing, or has more bytes.
    """
    flags = os.O_RDONLY | _FLAGS | (0 if follow else _NO_LINK)
    try:
        size = _size_of_regular(path, path.stat() if follow else path.lstat())
        with os.fdopen(os.open(path, flags), "rb") as file:
            size = _size_of_regular(path, os.fstat(file.fileno()))
            if most is not None and size > most:
                raise UserError(f"{path}: has {size} bytes, must be at most {most}")
            # the size is only a claim: that of a file in /proc is 0
            data = file.read(size + 1 if most is None else min(size, most) + 1)
            if len(data) > size:
                data += file.read(-1 if most is None else most + 1 - len(data))
    except (FileNotFoundError, ValueError) as error:  # ValueError: a NUL in the path
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None
    except OSError as error:
        raise UnreadableError(f"{path}: cannot be read: {one_line(error)}") from None
    if most is not None and len(data) > most:
        raise UserError(f"{path}: has more than {most} bytes, must be at most {most}")
    return data


def check_regular(path: Path, most: int) -> int:
    """The size in bytes of a file that another program will read.

    Args:
        path: the file.
        most: largest number of bytes.

    Raises:
        UserError: it is missing, not a regular file, or has more bytes.
    """
    try:
        size = _size_of_regular(path, path.stat())
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None
    if size > most:
        raise UserError(f"{path}: has {size} bytes, must be at most {most}")
    return size


def open_appendable(path: Path) -> BufferedRandom:
    """Open a file of a folder from anywhere, to read and to append; create it if it is missing.

    A pipe would block, and a link would lead to a file outside the folder.

    Raises:
        OSError: it cannot be opened.
        UserError: there is something that is not a regular file.
    """
    if os.path.lexists(path):
        _size_of_regular(path, path.lstat())
    descriptor = _open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT | _NO_LINK)
    return os.fdopen(descriptor, "a+b")


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file of a folder from anywhere, to read; no link is followed.

    Raises:
        OSError: it is missing or cannot be opened.
        UnreadableError: there is something that is not a regular file.
    """
    _size_of_regular(path, path.lstat())
    return os.fdopen(_open(path, os.O_RDONLY | _NO_LINK), "rb")


def _open(path: Path, flags: int) -> int:
    """A descriptor of a regular file; anything else is closed again and refused."""
    descriptor = os.open(path, flags | _FLAGS, 0o666)
    try:
        _size_of_regular(path, os.fstat(descriptor))
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def read_text(path: Path, most: int) -> str:
    """The text of a regular file in UTF-8.

    Raises:
        UserError: it is missing, not a regular file, has more than `most` bytes, or is not UTF-8.
    """
    try:
        return read_bytes(path, most).decode("utf-8")
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None


def _size_of_regular(path: Path, facts: os.stat_result) -> int:
    if stat.S_ISDIR(facts.st_mode):
        raise IsADirectoryError("Is a directory")
    if not stat.S_ISREG(facts.st_mode):
        kind = _KINDS.get(stat.S_IFMT(facts.st_mode), "something else")
        raise UnreadableError(f"{path}: is {kind}, must be a regular file")
    return facts.st_size
