"""Error messages about values of the wrong type, for those who can correct them."""

import dataclasses
import math
import re
import types
import typing
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, Union, cast

import msgspec

from touchdown.core.errors import one_line
from touchdown.core.names import hint

_LONGEST = 60  # characters of a value shown in a message
_PLAIN: dict[Any, tuple[tuple[type, ...], str]] = {
    int: ((int,), "a whole number"),
    float: ((int, float), "a number"),
    str: ((str,), "a string"),
    bool: ((bool,), "true or false"),
    list: ((list, tuple), "a list"),
    tuple: ((list, tuple), "a list"),
    type(None): ((type(None),), "null"),
}
"""Accepted types and the description of each type; all other types are objects."""


def complaint(value: object, kind: Any, name: str = "") -> str | None:
    """The first error in a value, such as `gamma = -0.1: must be from 0 to 1`.

    Args:
        value: a value of plain types, as read from a file.
        kind: the type that it should have: plain types, lists, dictionaries, records, and unions
            and choices of them. Bounds are those of its `msgspec.Meta`, whose title and
            description, if given, replace the descriptions of the type and the bounds.
        name: name of the value; its parts are named by a dotted path.

    Returns:
        None if nothing is wrong.
    """
    origin = typing.get_origin(kind)
    if origin in (Union, types.UnionType):
        return _of_union(value, kind, name)
    if not _is_of(value, kind):
        return _refusal(value, name, _wanted(kind))
    if origin is Annotated:
        of, meta = typing.get_args(kind)
        return (
            complaint(value, of, name) or _unlike(value, meta, name) or _beyond(value, meta, name)
        )
    if kind is float and not _is_finite(cast(float, value)):
        return _refusal(value, name, "a finite number")
    if _is_record(kind):
        return _of_record(cast(dict[str, object], value), kind, name)
    return _first(_parts(value, kind, name))


def _refusal(value: object, name: str, wanted: str) -> str:
    if not name:
        return f"is of type {type(value).__name__}, must be {wanted}"
    shown = repr(value)
    if len(shown) > _LONGEST:
        shown = f"{shown[: _LONGEST - 3]}..."
    return f"{name} = {shown}: must be {wanted}"


def _joined(name: str, part: str) -> str:
    return f"{name}.{part}" if name else part


def _parts(value: object, kind: Any, name: str) -> Iterator[tuple[str, object, Any]]:
    """The entries of a list or a dictionary: name, value and type of each."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (list, tuple):
        for index, entry in enumerate(cast(Sequence[object], value)):
            yield f"{name}[{index}]", entry, arguments[0]
    elif origin is dict:
        for key, entry in cast(dict[str, object], value).items():
            yield _joined(name, key), entry, arguments[1]


def _first(parts: Iterable[tuple[str, object, Any]]) -> str | None:
    said = (complaint(value, kind, name) for name, value, kind in parts)
    return next((words for words in said if words), None)


def _of_union(value: object, kind: Any, name: str) -> str | None:
    members = typing.get_args(kind)
    said = [complaint(value, each, name) for each in members]
    if None in said:
        return None
    nearest = (words for words, each in zip(said, members, strict=True) if _is_of(value, each))
    return next(nearest, None) or _refusal(value, name, _wanted(kind))


def _beyond(value: object, meta: msgspec.Meta, name: str) -> str | None:
    """The error in a value of the right type that may be out of bounds."""
    if meta.min_length is not None and len(cast(Sequence[object], value)) < meta.min_length:
        return _refusal(value, name, meta.description or f"{meta.min_length} or more values")
    number, low, above, high = cast(float, value), meta.ge, meta.gt, meta.le
    if (
        (low is None or number >= low)
        and (above is None or number > above)
        and (high is None or number <= high)
    ):
        return None
    if meta.description:
        return _refusal(value, name, meta.description)
    if low is not None and high is not None:
        return _refusal(value, name, f"from {low} to {high}")
    if above is not None:
        return _refusal(value, name, f"above {above}")
    return _refusal(value, name, f"at least {low}" if low else f"{low} or more")


def _unlike(value: object, meta: msgspec.Meta, name: str) -> str | None:
    """The error in a text that is not of the right form."""
    if meta.pattern is None or re.search(meta.pattern, cast(str, value)):
        return None
    return _refusal(value, name, meta.description or f"text like {meta.pattern}")


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number too large for a float
        return False


class _Field(NamedTuple):
    name: str
    """Name in a file."""
    kind: Any
    required: bool


def _is_record(kind: Any) -> bool:
    return isinstance(kind, type) and (
        issubclass(kind, msgspec.Struct) or dataclasses.is_dataclass(cast(type[Any], kind))
    )


@cache
def _fields(record: type[Any]) -> tuple[_Field, ...]:
    return tuple(_each_field(record))


def _each_field(record: type[Any]) -> Iterator[_Field]:
    if issubclass(record, msgspec.Struct):
        for each in msgspec.structs.fields(record):
            yield _Field(each.encode_name, each.type, each.required)
        return
    hints = typing.get_type_hints(record, include_extras=True)
    for each in dataclasses.fields(record):
        given = (each.default, each.default_factory)
        required = all(default is dataclasses.MISSING for default in given)
        yield _Field(each.name, hints[each.name], required)


def _of_record(values: dict[str, object], kind: type[Any], name: str) -> str | None:
    known = [each.name for each in _fields(kind)]
    if issubclass(kind, msgspec.Struct) and kind.__struct_config__.forbid_unknown_fields:
        unknown = next((given for given in values if given not in known), None)
        if unknown is not None:
            said = f"unknown field {unknown!r}; {hint(unknown, known)}"
            return f"{name}: {said}" if name else said
    for each in _fields(kind):
        if each.name not in values and each.required:
            return f"{_joined(name, each.name)}: missing"
    said = _first(
        (_joined(name, each.name), values[each.name], each.kind)
        for each in _fields(kind)
        if each.name in values
    )
    if said:
        return said
    try:
        msgspec.convert(values, kind)
    except msgspec.ValidationError as error:
        # each field is right, but a rule of the record is broken, whose message names the field
        return _joined(name, one_line(error.__cause__ or error))
    return None


def _is_of(value: object, kind: Any) -> bool:
    """Whether a value is of a type, without checking its bounds or parts."""
    if kind is Any:
        return True
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is Annotated:
        return _is_of(value, arguments[0])
    if origin is Literal:
        return any(type(each) is type(value) and each == value for each in arguments)
    if isinstance(value, bool) and kind is not bool:
        return False
    wanted, _ = _PLAIN.get(origin or kind, ((dict,), ""))
    return isinstance(value, wanted)


def _wanted(kind: Any) -> str:
    """The description of a type."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is Annotated:
        return arguments[1].title or _wanted(arguments[0])
    if origin is Literal:
        return f"one of {', '.join(map(str, arguments))}"
    if origin in (Union, types.UnionType):
        return " or ".join(map(_wanted, arguments))
    _, words = _PLAIN.get(origin or kind, ((dict,), "an object"))
    return words
