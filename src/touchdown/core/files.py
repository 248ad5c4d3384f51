"""Writes files so that they are always complete, and reads files that may be damaged."""

import errno
import hashlib
import json
import os
import shutil
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import msgspec
from safetensors import SafetensorError
from safetensors.numpy import load

from touchdown.core import records
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import Tensors


def write_atomic(path: Path, data: bytes | str) -> None:
    """Write a file under a temporary name, flush it to the disk and rename it.

    Raises:
        OSError: the folder is not writable or the disk is full; the previous file is kept.
    """
    write_through(path, lambda temporary: temporary.write_bytes(_encoded(data)))


def write_through(path: Path, write: Callable[[Path], object]) -> None:
    """Call `write` for a file with a temporary name in the same folder, then rename it.

    The temporary name keeps the suffix, because picture writers depend on it.
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        write(temporary)
        _sync(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_folder_atomic(path: Path, write: Callable[[Path], object]) -> None:
    """Call `write` for a temporary folder, then rename it.

    Raises:
        OSError: `path` already exists, or cannot be written; nothing is left behind.
    """
    if path.exists():
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    shutil.rmtree(temporary, ignore_errors=True)
    try:
        temporary.mkdir(parents=True)
        write(temporary)
        for file in temporary.iterdir():
            if file.is_file():
                _sync(file)
        temporary.replace(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


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


def read_bytes(path: Path, most: int) -> bytes:
    """The bytes of a file from any source.

    Args:
        path: the file.
        most: largest number of bytes.

    Raises:
        UserError: it is missing, not a file, or has more bytes.
    """
    try:
        size = path.stat().st_size
        if size > most:
            raise UserError(f"{path}: has {size} bytes, must be at most {most}")
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None


def read_jsonl(path: Path) -> list[dict[str, Any]]:
    """The objects of a JSON Lines file; a last line without its newline is still being written.

    Raises:
        UserError: the file is missing, or a complete line is not a JSON object.
    """
    return records.decode_jsonl(path, dict[str, Any])


def parse_json_object(path: Path, data: bytes) -> dict[str, Any]:
    """One JSON object from another program, perhaps with NaN and Infinity.

    Args:
        path: source of the bytes, named in error messages.
        data: the bytes.

    Raises:
        UserError: the bytes are something else.
    """
    try:
        value = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: not JSON, perhaps truncated: {one_line(error)}") from None
    if not isinstance(value, dict):
        raise UserError(f"{path}: is of type {type(value).__name__}, must be a JSON object")
    return cast(dict[str, Any], value)


class _TensorsHeader(msgspec.Struct):
    metadata: dict[str, str] = msgspec.field(name="__metadata__", default_factory=dict[str, str])


def read_tensors(path: Path, sha256: str | None = None) -> tuple[Tensors, dict[str, str]]:
    """A safetensors file's arrays and metadata.

    Args:
        path: the file.
        sha256: required hash of its bytes; None accepts any.

    Raises:
        UserError: it is missing, truncated, altered or something else.
    """
    try:
        data = path.read_bytes()
        tensors = load(data)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None
    except (SafetensorError, ValueError, KeyError) as error:
        raise UserError(f"{path}: not a complete safetensors file: {one_line(error)}") from None
    if sha256 is not None and hashlib.sha256(data).hexdigest() != sha256:
        raise UserError(f"{path}: altered since it was written (its SHA-256 differs)")
    header = data[8 : 8 + int.from_bytes(data[:8], "little")]
    return tensors, records.decode(header, _TensorsHeader, path).metadata


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


def remove_temporaries(folders: Iterable[Path]) -> None:
    """Delete temporary files of killed writers in these folders."""
    for folder in folders:
        for leftover in folder.glob(".*.tmp*"):
            if leftover.is_dir():
                shutil.rmtree(leftover, ignore_errors=True)
            else:
                leftover.unlink(missing_ok=True)


def _encoded(data: bytes | str) -> bytes:
    # text may quote the name of a folder, whose bytes need not be text
    return data.encode(errors="replace") if isinstance(data, str) else data


def _sync(path: Path) -> None:
    with path.open("rb") as file:
        os.fsync(file.fileno())
