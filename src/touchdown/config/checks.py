"""Checks of a section's fields, where a config is made."""

import dataclasses
import math
import re
import typing
from typing import Any, Literal, cast

import numpy as np


def check(section: object, name: str, *, ok: bool, wanted: str) -> None:
    """Refuse a field's value.

    Raises:
        ValueError: it is not `ok`; names the field, the value and what is wanted.
    """
    if not ok:
        raise ValueError(f"{name} = {getattr(section, name)!r}: must be {wanted}")


def is_plain_name(name: str) -> bool:
    """Whether a name can be a folder's everywhere, and a figure's title."""
    return re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}", name) is not None


def settle(section: Any) -> None:
    """Refuse a value of another type than its field's, and make equals alike.

    1 and 1.0, a list and a tuple, NumPy's scalars and Python's: the same setting, one digest.

    Args:
        section: a frozen dataclass that is being made.

    Raises:
        ValueError: a field's value is of another type, not among its choices, or not finite.
    """
    for name, kind in typing.get_type_hints(cast(type[Any], type(section))).items():
        object.__setattr__(section, name, _coerced(kind, name, getattr(section, name)))


def _coerced(kind: Any, name: str, given: Any) -> Any:
    value: Any = cast(Any, given).item() if isinstance(given, np.generic) else given
    if dataclasses.is_dataclass(kind):
        if not isinstance(value, cast(type, kind)):
            raise ValueError(f"{name} = {value!r}: must be a {cast(type, kind).__name__}")
        return value
    if typing.get_origin(kind) is Literal:
        choices = typing.get_args(kind)
        if value not in choices:
            raise ValueError(f"{name} = {value!r}: must be one of {', '.join(choices)}")
        return value
    if typing.get_origin(kind) is tuple:
        if not isinstance(value, list | tuple):
            raise ValueError(f"{name} = {value!r}: must be a list")
        of = typing.get_args(kind)[0]
        return tuple(_coerced(of, name, entry) for entry in cast(list[Any], value))
    if kind is float and type(value) in (int, float):
        try:
            value = float(value) + 0.0  # -0.0 becomes 0.0
        except OverflowError:
            value = math.inf
        if not math.isfinite(value):
            raise ValueError(f"{name} = {value!r}: must be a finite number")
    if type(value) is not kind:
        kinds = {int: "a whole number", float: "a number", str: "a string", bool: "true or false"}
        wanted = kinds[kind]
        raise ValueError(f"{name} = {value!r}: must be {wanted}")
    return value
