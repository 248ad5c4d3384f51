"""A model of a disk whose power fails: what was not flushed is lost.

At each flush and rename it keeps two trees, the two ends of what a disk may hold afterwards: one in
which only what was flushed has happened, and one in which all names and sizes are on the disk, but
of the data only what was flushed, and zeros for the rest.
"""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

Tree = tuple[tuple[str, bytes | None], ...]
"""Relative paths with their content, None for a folder; parents first."""


class Disk:
    """Watches a folder on a real disk.

    Args:
        root: the folder; what is in it now is taken as flushed.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self.trees: dict[Tree, None] = {}
        """The distinct trees that a power loss could have left so far, in order."""
        self._data: dict[int, bytes] = {}
        self._names: dict[int, dict[str, int]] = {}
        self._held: list[int] = []  # open, so that no number of an inode is used again
        for path in (root, *root.rglob("*")):
            self._flush(os.open(path, os.O_RDONLY))

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Watch all flushes and renames of this process."""
        fsync, rename = os.fsync, Path.replace

        def flush(descriptor: int) -> None:
            fsync(descriptor)
            self._flush(os.dup(descriptor))
            self._keep()

        def replace(path: Path, target: Path) -> Path:
            done = rename(path, target)
            self._keep()
            return done

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, "fsync", flush)
            patch.setattr(Path, "replace", replace)
            yield

    def _flush(self, descriptor: int) -> None:
        self._held.append(descriptor)
        found = os.fstat(descriptor)
        if stat.S_ISDIR(found.st_mode):
            with os.scandir(descriptor) as entries:
                self._names[found.st_ino] = {each.name: each.inode() for each in entries}
        else:
            self._data[found.st_ino] = Path(f"/proc/self/fd/{descriptor}").read_bytes()

    def _keep(self) -> None:
        flushed = tuple(self._flushed(self.root.stat().st_ino, ""))
        self.trees |= {flushed: None, tuple(self._named()): None}

    def _flushed(self, inode: int, place: str) -> Iterator[tuple[str, bytes | None]]:
        for name, of in sorted(self._names.get(inode, {}).items()):
            if of in self._data:
                yield place + name, self._data[of]
            elif of in self._names:
                yield place + name, None
                yield from self._flushed(of, f"{place}{name}/")
            else:
                yield place + name, b""  # a name whose content never came

    def _named(self) -> Iterator[tuple[str, bytes | None]]:
        for path in sorted(self.root.rglob("*")):
            name, found = str(path.relative_to(self.root)), path.stat()
            if path.is_dir():
                yield name, None
            else:
                data = self._data.get(found.st_ino, b"")[: found.st_size]
                yield name, data.ljust(found.st_size, b"\0")


def lay_out(tree: Tree, root: Path) -> Path:
    """Write a tree into a new folder."""
    root.mkdir(parents=True)
    for name, data in tree:
        if data is None:
            (root / name).mkdir()
        else:
            (root / name).write_bytes(data)
    return root
