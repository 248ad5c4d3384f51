"""Temporary files and folders of writers, each locked while its writer lives.

A killed writer leaves its temporary file behind, but not the lock. The next writer in the same
folder removes what is not locked.
"""

import fcntl
import os
import re
import secrets
import shutil
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager, suppress
from pathlib import Path

_TEMPORARY = re.compile(r"\..*\.\d+(-[0-9a-f]+)?\.tmp(\..*)?", re.DOTALL)


@contextmanager
def temporary_file(path: Path, mode: int | None = None) -> Generator[Path]:
    """An empty file beside a path, with the same suffix, which the block writes and renames.

    Args:
        path: the path.
        mode: permissions of the file, to which the right to write it is added; None uses those of
            new files.

    Raises:
        OSError: it cannot be created.
    """

    def create(temporary: Path) -> int:
        flags = os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_RDWR
        descriptor = os.open(temporary, flags, 0o666 if mode is None else 0o600)
        if mode is not None:
            os.fchmod(descriptor, mode | 0o600)
        return descriptor

    temporary, lock = _locked(path, path.stem, path.suffix, create)
    try:
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)
        os.close(lock)


@contextmanager
def temporary_folder(path: Path) -> Generator[Path]:
    """An empty folder beside a path, which the block fills and renames.

    Raises:
        OSError: it cannot be created.
    """

    def create(temporary: Path) -> int:
        temporary.mkdir()
        return os.open(temporary, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)

    temporary, lock = _locked(path, path.name, "", create)
    try:
        yield temporary
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        os.close(lock)


def remove_temporaries(folders: Iterable[Path]) -> None:
    """Delete temporary files and folders of killed writers in these folders.

    A writer that is still at work holds a lock on its own, on this machine or another.
    """
    for folder in folders:
        with suppress(OSError):  # a folder that is not there, or must not be changed
            for leftover in list(folder.iterdir()):
                if is_temporary(leftover):
                    _remove_unlocked(leftover)


def is_temporary(path: Path) -> bool:
    """Whether a path has the name of a temporary file or folder of a writer."""
    return _TEMPORARY.fullmatch(path.name) is not None


def _locked(path: Path, stem: str, suffix: str, create: Callable[[Path], int]) -> tuple[Path, int]:
    """Create something beside a path and lock it, as a sign that its writer lives.

    Returns:
        Its path, which nobody can guess and prepare a link at, and its descriptor.
    """
    while True:
        # shortened, because the name of a file may have no more than 255 bytes
        name = f".{stem[:40]}.{os.getpid()}-{secrets.token_hex(4)}.tmp{suffix}"
        temporary = path.with_name(name)
        try:
            descriptor = create(temporary)
        except FileExistsError:
            continue
        with suppress(OSError):  # a file system without locks, where nothing is removed
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(descriptor), temporary.lstat()):
                return temporary, descriptor
        os.close(descriptor)  # another process removed it before the lock


def _remove_unlocked(leftover: Path) -> None:
    with suppress(OSError):
        descriptor = os.open(leftover, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if leftover.is_dir():
                shutil.rmtree(leftover, ignore_errors=True)
            else:
                leftover.unlink(missing_ok=True)
        finally:
            os.close(descriptor)
