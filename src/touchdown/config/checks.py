"""Checks of a section's fields when a config is made."""

import contextlib
import dataclasses
import math
import re
import sys
import typing
from functools import cache
from typing import Annotated, Any, cast

import msgspec

from touchdown.core.complaints import complaint


def check(section: object, name: str, *, ok: bool, wanted: str) -> None:
    """Refuse a field's value unless it is `ok`.

    Raises:
        ValueError: it is not `ok`; the message names the field, the value and what is wanted.
    """
    if not ok:
        raise ValueError(f"{name} = {getattr(section, name)!r}: must be {wanted}")


def is_plain_name(name: str) -> bool:
    """Whether a name is valid as a folder's on every system, and as a figure's title."""
    return re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}", name) is not None


def settle(section: Any) -> None:
    """Refuse values that are of the wrong type or out of bounds, and make equal values identical.

    1 and 1.0, a list and a tuple, a NumPy scalar and a Python one are the same setting and give
    the same digest.

    Args:
        section: a frozen dataclass under construction.

    Raises:
        ValueError: a field's value is of the wrong type, out of bounds, not among its choices, or
            not finite.
    """
    for name, kind in _kinds(cast(type[Any], type(section))).items():
        object.__setattr__(section, name, _settled(getattr(section, name), kind, name))


@cache
def _kinds(section: type[Any]) -> dict[str, Any]:
    """The types of a section's fields, with their bounds."""
    hints = typing.get_type_hints(section, include_extras=True)
    return {each.name: hints[each.name] for each in dataclasses.fields(section)}


def _settled(given: Any, kind: Any, name: str) -> Any:
    if dataclasses.is_dataclass(kind):
        if not isinstance(given, cast(type, kind)):
            raise ValueError(f"{name} = {given!r}: must be a {cast(type, kind).__name__}")
        return given
    value = _plain(given)
    try:
        settled = msgspec.convert(value, kind)
    except msgspec.ValidationError:
        settled = math.nan
    # TOML and Python allow infinity and NaN, which no type excludes
    if _is_finite(settled):
        return settled
    with contextlib.suppress(msgspec.ValidationError):
        # a number that is only out of bounds is shown in the field's type, 2 as 2.0
        value = msgspec.convert(value, _without_bounds(kind))
    said = complaint(value, kind, name)
    raise ValueError(said or f"{name} = {value!r}: must be a plain Python value")


def _without_bounds(kind: Any) -> Any:
    return typing.get_args(kind)[0] if typing.get_origin(kind) is Annotated else kind


def _plain(value: Any) -> Any:
    """A value without NumPy scalars and without negative zeros."""
    numpy = sys.modules.get("numpy")  # slow to load; without it no value is a NumPy scalar
    if numpy is not None and isinstance(value, numpy.generic):
        return _plain(value.item())
    if isinstance(value, dict):
        return {name: _plain(of) for name, of in cast(dict[Any, Any], value).items()}
    if isinstance(value, list | tuple):
        entries = [_plain(entry) for entry in cast(list[Any], value)]
        return entries if isinstance(value, list) else tuple(entries)
    return value + 0.0 if type(value) is float else value


def _is_finite(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_finite, cast(tuple[Any, ...], value)))
    if isinstance(value, dict):
        return all(map(_is_finite, cast(dict[str, Any], value).values()))
    return not isinstance(value, float) or math.isfinite(value)
