"""Reads files into typed records; the error for a wrong value is one line that names it.

A record is a `msgspec.Struct` or a frozen dataclass. Its fields have the names that the file uses,
or are renamed to them. Unknown fields are ignored, so that additions of later versions are allowed.
"""

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast

import msgspec

from touchdown.core import limits, reading
from touchdown.core.complaints import complaint
from touchdown.core.errors import UserError, one_line

Record = TypeVar("Record")

Count = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1, description="from 0 to 2**63 - 1")]
"""A whole number that fits NumPy's int64."""
Seconds = Annotated[float, msgspec.Meta(ge=0)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]


class _Versioned(msgspec.Struct):
    format_version: Any = None


def decode(data: bytes | str, kind: type[Record], where: object) -> Record:
    """A record from JSON.

    Args:
        data: the text.
        kind: the record's type.
        where: source named in error messages, such as the file's path.

    Raises:
        UserError: the text is not JSON, or a value in it is wrong.
    """
    try:
        return _decoder(kind).decode(data)
    except (ValueError, RecursionError) as error:
        raise UserError(f"{where}: {_what_is_wrong(data, kind, error)}") from None


def convert(value: object, kind: type[Record], where: object) -> Record:
    """A record from plain values, such as those of a TOML file.

    Args:
        value: the values.
        kind: the record's type.
        where: source named in error messages, such as the file's path.

    Raises:
        UserError: a value is wrong.
    """
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise UserError(f"{where}: {complaint(value, kind) or one_line(error)}") from None


def check(value: object, kind: Any, name: str) -> None:
    """Refuse a value that is not of a type.

    Args:
        value: a value of plain types.
        kind: the type.
        name: name of the value.

    Raises:
        ValueError: something is wrong with it.
    """
    if said := complaint(value, kind, name):
        raise ValueError(said)


def decode_json(path: Path, kind: type[Record], version: int | None = None) -> Record:
    """The record in a JSON file.

    Args:
        path: the file.
        kind: the record's type.
        version: required `format_version`; None accepts any.

    Raises:
        UserError: the file is missing, truncated or of another version, or a value in it is wrong.
    """
    data = reading.read_bytes(path, limits.RECORD_BYTES)
    if version is not None:
        check_version(data, (version,), path)
    return decode(data, kind, path)


def check_version(data: bytes, readable: Sequence[int], where: object) -> None:
    """Refuse JSON whose `format_version` this version of touchdown cannot read.

    Args:
        data: the text.
        readable: the versions that can be read.
        where: source named in error messages, such as the file's path.

    Raises:
        UserError: the text is not JSON, or its `format_version` is another.
    """
    check_readable(decode(data, _Versioned, where).format_version, readable, where)


def check_readable(version: object, readable: Sequence[int | str], where: object) -> None:
    """Refuse a `format_version` that this version of touchdown cannot read.

    Args:
        version: the version of the file; in the metadata of tensors, it is text.
        readable: the versions that can be read.
        where: source named in error messages, such as the file's path.

    Raises:
        UserError: it is another.
    """
    if version not in readable or isinstance(version, bool):
        raise UserError(
            f"{where}: format_version = {version!r}: must be {' or '.join(map(str, readable))} "
            "in this version of touchdown"
        )


def decode_jsonl(path: Path, kind: type[Record]) -> list[Record]:
    """The records of a JSON Lines file; a last line without its newline is still being written.

    Args:
        path: the file.
        kind: the type of a line's record.

    Raises:
        UserError: the file is missing, or a complete line is not such a record.
    """
    data = reading.read_bytes(path, limits.RECORD_BYTES)
    return decode_lines(data[: data.rfind(b"\n") + 1], kind, path)


def decode_lines(lines: bytes, kind: type[Record], path: Path, first: int = 1) -> list[Record]:
    """The records in complete lines of a JSON Lines file.

    Args:
        lines: each with its newline.
        kind: the type of a line's record.
        path: the file, named in error messages.
        first: number of the first of the lines in the file.

    Raises:
        UserError: a line is not such a record.
    """
    try:
        records = cast(list[Record], _decoder(kind).decode_lines(lines))
    except (ValueError, RecursionError):
        records = None
    # as many records as lines: no line is empty or has two records
    if records is not None and len(records) == lines.count(b"\n"):
        return records
    return _line_by_line(path, lines.split(b"\n")[:-1], kind, first)


def _line_by_line(
    path: Path, lines: Sequence[bytes], kind: type[Record], first: int
) -> list[Record]:
    records: list[Record] = []
    for number, line in enumerate(lines, start=first):
        try:
            records.append(_decoder(kind).decode(line))
        except (ValueError, RecursionError) as error:
            raw = _untyped(line)
            if not isinstance(raw, dict):
                said = _not_finite(line) if raw is None else ""
                raise UserError(f"{path}: line {number} {said or 'is not a JSON object'}") from None
            said = _what_is_wrong(line, kind, error)
            raise UserError(f"{path}: line {number}: {said}") from None
    return records


def _not_finite(line: bytes) -> str:
    """That a line, which is no JSON, has a number that JSON lacks; "" if it has none."""
    found = re.search(rb"(?<=[\s:\[,])(NaN|-?Infinity)(?=[\s,\]}])", line)
    return f"has {found[0].decode()}, must have finite numbers" if found else ""


@cache
def _decoder(kind: type[Record]) -> msgspec.json.Decoder[Record]:
    return msgspec.json.Decoder(kind)


def _untyped(data: bytes | str) -> object:
    try:
        return msgspec.json.decode(data)
    except (ValueError, RecursionError):
        return None


def _what_is_wrong(data: bytes | str, kind: type[Any], error: BaseException) -> str:
    try:
        value = msgspec.json.decode(data)
    except (ValueError, RecursionError) as no_json:
        return f"not JSON, perhaps truncated: {one_line(no_json)}"
    return complaint(value, kind) or one_line(error)
