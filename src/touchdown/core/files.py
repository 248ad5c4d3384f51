"""Writes files so that they are always complete, and reads files that may be damaged."""

import errno
import fcntl
import hashlib
import json
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import msgspec
from safetensors import SafetensorError
from safetensors.numpy import load, save

from touchdown.core import limits, reading, records, temporaries
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import Tensors


def write_atomic(path: Path, data: bytes | str, *, follow: bool = True) -> None:
    """Write a file completely or not at all; see `write_through`.

    Args:
        path: the file.
        data: its content.
        follow: whether a symbolic link is followed.

    Raises:
        OSError: the folder is not writable or the disk is full; the previous file is kept.
    """
    write_through(path, lambda temporary: temporary.write_bytes(_encoded(data)), follow=follow)


def write_through(path: Path, write: Callable[[Path], object], *, follow: bool = True) -> None:
    """Call `write` for a file with a temporary name, flush it to the disk and rename it.

    A path that the user names may be a symbolic link: its target is replaced, and the link stays.
    Or it is a device, a pipe or an open file of this process, such as `/dev/stdout`, which is
    written into. A file of a run's folder, which may come from anywhere, replaces what is there.

    Args:
        path: the file.
        write: writes a file of the given path. Its name has the suffix of `path`, because picture
            writers depend on it.
        follow: False for a file of a run's folder.

    Raises:
        OSError: the file cannot be written; the previous one is kept.
    """
    target = _followed(path) if follow else path
    if follow and _takes_a_stream(target):
        with tempfile.TemporaryDirectory() as folder:
            temporary = Path(folder) / f"stream{path.suffix}"
            write(temporary)
            _pour(temporary, target)
        return
    temporaries.remove_temporaries([target.parent])
    mode = _mode_of(target)  # a private file stays private, even while it is written
    with temporaries.temporary_file(target, mode) as temporary:
        write(temporary)
        if mode is not None:
            temporary.chmod(mode)  # its writer may have made another file, or one that is read-only
        sync(temporary)
        temporary.replace(target)
    sync(target.parent)


def write_folder_atomic(path: Path, write: Callable[[Path], object]) -> None:
    """Call `write` for a temporary folder, flush its files to the disk and rename it.

    Raises:
        OSError: `path` already exists, its parent does not, or it cannot be written; nothing is
            left behind.
    """
    if path.exists():
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    temporaries.remove_temporaries([path.parent])
    with temporaries.temporary_folder(path) as temporary:
        write(temporary)
        for inside in [*temporary.rglob("*"), temporary]:
            sync(inside)
        temporary.replace(path)
    sync(path.parent)


@contextmanager
def complete_folder(path: Path) -> Generator[Path]:
    """A temporary folder that the block fills, and that then becomes `path`.

    If that folder exists, the new files replace those of the same name, one after the other, since
    the user may keep other files there. If the block fails, nothing is changed.

    Raises:
        UserError: the folder cannot be written, or as in the block, with the name of the folder in
            place of the temporary one's.
    """
    target = _followed(path)
    with refusing(f"out {str(path)!r}"):
        make_folder(target.parent)
        beside = target / target.name if target.is_dir() else target
        temporaries.remove_temporaries([beside.parent])
        with temporaries.temporary_folder(beside) as temporary:
            try:
                yield temporary
            except UserError as error:
                said = str(error).replace(str(temporary), str(path))
                raise UserError(said) from error.__cause__
            for inside in [*temporary.rglob("*"), temporary]:
                sync(inside)
            if target.is_dir():
                for inside in filter(Path.is_file, temporary.rglob("*")):
                    replaced = target / inside.relative_to(temporary)
                    make_folder(replaced.parent)
                    inside.replace(replaced)
            else:
                temporary.replace(target)
        sync(target.parent)


def make_folder(path: Path) -> None:
    """Create a folder with its parents, unless it exists, and flush its name to the disk.

    Raises:
        OSError: it cannot be created, or there is something else.
    """
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    path.mkdir(parents=True, exist_ok=True)
    for folder in missing:
        sync(folder.parent)


def sync(path: Path) -> None:
    """Flush a file, or the names in a folder, to the disk.

    Raises:
        OSError: it cannot be flushed, for example because the disk is full.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except PermissionError:
        if path.is_dir():  # names may be added to a folder whose names may not be read
            return
        raise
    try:
        flush(descriptor)
    except OSError as error:
        # some network file systems cannot flush a folder
        if error.errno not in (errno.EINVAL, errno.ENOTSUP) or not path.is_dir():
            raise
    finally:
        os.close(descriptor)


def flush(descriptor: int) -> None:
    """Flush an open file to the disk.

    Raises:
        OSError: it cannot be flushed.
    """
    full: int | None = getattr(fcntl, "F_FULLFSYNC", None)
    if full is not None:
        with suppress(OSError):  # not on every file system
            fcntl.fcntl(descriptor, full)  # on macOS, fsync does not empty the disk's own cache
            return
    os.fsync(descriptor)


def _mode_of(path: Path) -> int | None:
    """The permissions of a regular file; None of anything else."""
    try:
        mode = path.lstat().st_mode
    except OSError:
        return None
    return stat.S_IMODE(mode) if stat.S_ISREG(mode) else None


def _followed(path: Path) -> Path:
    """The end of a chain of symbolic links; it need not exist."""
    for _ in range(_MOST_LINKS):
        if not path.is_symlink() or _open_file(path) is not None:
            return path
        path = path.parent / path.readlink()
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))


def _open_file(path: Path) -> int | None:
    """The descriptor that `/proc/self/fd/1` or `/dev/fd/1` names; None of other paths."""
    # /dev/fd is a link to the first on Linux, and a folder on macOS
    own = path.parent.resolve() in (Path(f"/proc/{os.getpid()}/fd"), Path("/dev/fd"))
    return int(path.name) if own and path.name.isdecimal() else None


def _takes_a_stream(target: Path) -> bool:
    """Whether a path is to be written into: something that is neither a file nor a folder."""
    if _open_file(target) is not None:
        return True
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
    return target.exists() and not target.is_file()


def _pour(source: Path, target: Path) -> None:
    """Copy a file into a device, a pipe or an open file."""
    opened = _open_file(target)
    if opened is not None:
        descriptor = os.dup(opened)  # shares the position with what is printed
    else:
        # a pipe without a reader is refused at once, instead of waiting for one
        descriptor = os.open(target, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        os.set_blocking(descriptor, True)
    with source.open("rb") as data, os.fdopen(descriptor, "wb") as stream:
        shutil.copyfileobj(data, stream)


def check_file(path: Path, name: str) -> None:
    """Refuse a path that cannot become a file, before the work whose result it is to hold.

    Args:
        path: the path.
        name: name of the option.

    Raises:
        UserError: the path is a folder, or its folder does not exist.
    """
    if not path.name or path.is_dir():
        raise UserError(f"{name} {str(path)!r}: must be a file, not a folder")
    if not path.absolute().parent.is_dir():
        raise UserError(f"{name} {str(path)!r}: its folder does not exist")


def check_new(path: Path, *, force: bool) -> None:
    """Check before the work that an output replaces nothing, unless the user asks for it.

    Args:
        path: a file or folder to write; devices and pipes are not replaced, so they are accepted.
        force: whether the user asks for it.

    Raises:
        UserError: there is a file or folder already.
    """
    if not force and (path.is_file() or path.is_dir()):
        raise UserError(
            f"out {str(path)!r}: exists already; choose another, or replace it with --force"
        )


@contextmanager
def refusing(where: str) -> Generator[None]:
    """Turn a system error in a block that writes into one line for the user.

    Args:
        where: what cannot be written, such as its path.

    Raises:
        UserError: an OSError was raised inside.
    """
    try:
        yield
    except OSError as error:
        raise UserError(f"{where}: cannot be written: {one_line(error)}") from None


def read_jsonl(path: Path) -> list[dict[str, Any]]:
    """The objects of a JSON Lines file; a last line without its newline is still being written.

    Raises:
        UserError: the file is missing, or a complete line is not a JSON object.
    """
    return records.decode_jsonl(path, dict[str, Any])


_MOST_LINKS = 40  # in a chain, as in Linux


class _TensorsHeader(msgspec.Struct):
    metadata: dict[str, str] = msgspec.field(name="__metadata__", default_factory=dict[str, str])


def read_tensors(
    path: Path, sha256: str | None = None, most: int | None = None
) -> tuple[Tensors, dict[str, str]]:
    """A safetensors file's arrays and metadata.

    Args:
        path: the file.
        sha256: required hash of its bytes; None accepts any.
        most: largest number of bytes; None accepts any size.

    Raises:
        UserError: it is missing, too large, truncated, altered or something else.
    """
    data = reading.read_bytes(path, most)
    header_size = int.from_bytes(data[:8], "little")
    if len(data) > header_size > limits.TENSORS_HEADER_BYTES:
        raise UserError(
            f"{path}: its header has {header_size} bytes, must be at most "
            f"{limits.TENSORS_HEADER_BYTES}"
        )
    try:
        tensors = load(data)
    except (SafetensorError, ValueError, KeyError) as error:
        raise UserError(f"{path}: not a complete safetensors file: {one_line(error)}") from None
    if sha256 is not None and hashlib.sha256(data).hexdigest() != sha256:
        raise UserError(f"{path}: altered since it was written (its SHA-256 differs)")
    return tensors, records.decode(data[8 : 8 + header_size], _TensorsHeader, path).metadata


def to_safetensors(tensors: Tensors, metadata: Mapping[str, str] | None = None) -> bytes:
    """Arrays and metadata as a safetensors file; the same content gives the same bytes.

    Args:
        tensors: arrays by name, each contiguous.
        metadata: texts by name; None writes no metadata.
    """
    data = save(tensors, None if metadata is None else dict(metadata))
    start = 8 + int.from_bytes(data[:8], "little")
    header = json.loads(data[8:start])
    if metadata is not None:
        # the library writes metadata in another order each time
        header["__metadata__"] = dict(sorted(metadata.items()))
    text = json.dumps(header, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)  # the arrays begin at a multiple of 8 bytes
    return len(text).to_bytes(8, "little") + text + data[start:]


def to_json(value: object) -> str:
    """Plain values and records as readable JSON with a final newline."""
    text = json.dumps(
        value, indent=2, ensure_ascii=False, allow_nan=False, default=msgspec.to_builtins
    )
    return text + "\n"


def to_json_line(value: object) -> bytes:
    """Plain values and records as one line of JSON Lines."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, default=msgspec.to_builtins)
    return text.encode() + b"\n"


def _encoded(data: bytes | str) -> bytes:
    # text may quote the name of a folder, whose bytes need not be text
    return data.encode(errors="replace") if isinstance(data, str) else data
