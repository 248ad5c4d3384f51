"""Writing so that what is on disk is always whole, and reading what a crash may have left."""

import errno
import hashlib
import json
import os
import shutil
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from safetensors import SafetensorError
from safetensors.numpy import load

from touchdown.core.errors import UserError, one_line
from touchdown.core.types import Tensors


def write_atomic(path: Path, data: bytes | str) -> None:
    """Write a file under a temporary name, flush it to the disk and rename it.

    Raises:
        OSError: the folder is not writable or the disk is full; what was there before stays.
    """
    write_through(path, lambda temporary: temporary.write_bytes(_encoded(data)))


def write_through(path: Path, write: Callable[[Path], object]) -> None:
    """Have `write` make a file under a temporary name in the same folder, then rename it.

    The temporary name keeps the suffix, which picture writers go by.
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        write(temporary)
        _sync(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_folder_atomic(path: Path, write: Callable[[Path], object]) -> None:
    """Have `write` fill a temporary folder with files, then rename it.

    Raises:
        OSError: `path` exists already, or cannot be written; nothing is left behind.
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


@contextmanager
def refusing(where: str) -> Generator[None]:
    """Turn what the system says against writing, within the block, into a line for the user.

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
    """A file that may have come from anywhere.

    Args:
        path: of the file.
        most: bytes that it may have.

    Raises:
        UserError: it is missing, no file, or has more bytes.
    """
    try:
        size = path.stat().st_size
        if size > most:
            raise UserError(f"{path}: has {size} bytes, must be at most {most}")
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None


def read_json(path: Path) -> dict[str, Any]:
    """A JSON file that holds one object.

    Raises:
        UserError: it is missing, cut off, or holds something else.
    """
    try:
        return parse_json_object(path, path.read_bytes())
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None


def parse_json_object(path: Path, data: bytes) -> dict[str, Any]:
    """One JSON object from bytes that were read from `path`.

    Raises:
        UserError: the bytes are something else.
    """
    try:
        value = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: not JSON, perhaps cut off: {one_line(error)}") from None
    if not isinstance(value, dict):
        raise UserError(f"{path}: holds {type(value).__name__}, must be a JSON object")
    return cast(dict[str, Any], value)


def read_jsonl(path: Path, fields: Iterable[str] = ()) -> list[dict[str, Any]]:
    """The objects of a JSON Lines file; a last line without its newline is still being written.

    Args:
        path: of the file.
        fields: that every line must have.

    Raises:
        UserError: the file is missing, or a whole line is not a JSON object with those fields.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None
    rows: list[dict[str, Any]] = []
    for number, line in enumerate(data.split(b"\n")[:-1], start=1):
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):
            row = None
        if not isinstance(row, dict):
            raise UserError(f"{path}: line {number} is not a JSON object")
        missing = [name for name in fields if name not in row]
        if missing:
            raise UserError(f"{path}: line {number} has no {missing[0]}")
        rows.append(cast(dict[str, Any], row))
    return rows


def read_tensors(path: Path, sha256: str | None = None) -> tuple[Tensors, dict[str, str]]:
    """A safetensors file's arrays and metadata.

    Args:
        path: of the file.
        sha256: what its bytes must hash to; None takes any.

    Raises:
        UserError: it is missing, cut off, altered or something else.
    """
    try:
        data = path.read_bytes()
        tensors = load(data)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None
    except (SafetensorError, ValueError, KeyError) as error:
        raise UserError(f"{path}: not a whole safetensors file: {one_line(error)}") from None
    if sha256 is not None and hashlib.sha256(data).hexdigest() != sha256:
        raise UserError(f"{path}: altered since it was written (its SHA-256 differs)")
    header = parse_json_object(path, data[8 : 8 + int.from_bytes(data[:8], "little")])
    return tensors, dict(header.get("__metadata__", {}))


def to_json(value: object) -> str:
    """Readable JSON with a closing newline."""
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def remove_temporaries(folders: Iterable[Path]) -> None:
    """Delete what writers that were killed left behind in these folders."""
    for folder in folders:
        for leftover in folder.glob(".*.tmp*"):
            if leftover.is_dir():
                shutil.rmtree(leftover, ignore_errors=True)
            else:
                leftover.unlink(missing_ok=True)


def _encoded(data: bytes | str) -> bytes:
    return data.encode() if isinstance(data, str) else data


def _sync(path: Path) -> None:
    with path.open("rb") as file:
        os.fsync(file.fileno())
