"""Temporary files and folders of writers, each locked while its writer lives.

A killed writer leaves its temporary file behind, but not the lock. The next writer in the same
folder removes what is not locked.
"""

import fcntl
import itertools
import os
import re
import shutil
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager, suppress
from pathlib import Path

_TEMPORARY = re.compile(r"\..*\.\d+(-\d+)?\.tmp(\..*)?", re.DOTALL)
_counter = itertools.count()  # one writer of a process may write while another one does


@contextmanager
def temporary_file(path: Path) -> Generator[Path]:
    """An empty file beside a path, with the same suffix, which the block writes and renames.

    Raises:
        OSError: it cannot be created.
    """
    temporary = _temporary_name(path, path.stem, path.suffix)
    lock = _locked(temporary, lambda: os.open(temporary, os.O_CREAT | os.O_RDWR, 0o666))
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
    temporary = _temporary_name(path, path.name, "")

    def create() -> int:
        temporary.mkdir(exist_ok=True)
        return os.open(temporary, os.O_RDONLY)

    lock = _locked(temporary, create)
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


def _temporary_name(path: Path, stem: str, suffix: str) -> Path:
    # shortened, because the name of a file may have no more than 255 bytes
    return path.with_name(f".{stem[:40]}.{os.getpid()}-{next(_counter)}.tmp{suffix}")


def _locked(temporary: Path, create: Callable[[], int]) -> int:
    """Create something and lock it, as a sign that its writer lives; return its descriptor."""
    while True:
        descriptor = create()
        with suppress(OSError):  # a file system without locks, where nothing is removed
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        if temporary.exists() and os.path.samestat(os.fstat(descriptor), temporary.stat()):
            return descriptor
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
