"""Changes to a config, as a level or a study file states them."""

from collections.abc import Iterator, Mapping
from typing import Any, cast

import numpy as np

from touchdown.core.errors import UserError

Changes = Mapping[str, Any]
"""Changes to a config: a mapping for a section, a value for a field, whose name may be dotted, such
as `learning.gamma`; `preset` starts from another preset."""


def nested(changes: Changes) -> dict[str, Any]:
    """The same changes as nested tables of plain values, as in a TOML file.

    Raises:
        UserError: a field is set twice, or is also a section.
    """
    found: dict[str, Any] = {}
    for name, value in by_dotted_name(changes):
        *sections, field = name.split(".")
        place = found
        for section in sections:
            inner = place.setdefault(section, {})
            if not isinstance(inner, dict):
                raise UserError(f"changes: {section!r}: is set both as a field and as a section")
            place = cast(dict[str, Any], inner)
        if field in place:
            raise UserError(f"changes: {name!r}: is set twice")
        place[field] = _plain(value)
    return found


def by_dotted_name(changes: Changes, before: str = "") -> Iterator[tuple[str, Any]]:
    """Each changed field by its dotted name, with its value."""
    for name, value in changes.items():
        if isinstance(value, Mapping):
            yield from by_dotted_name(cast(Changes, value), f"{before}{name}.")
        else:
            yield f"{before}{name}", value


def _plain(value: Any) -> Any:
    """The value as a TOML type: lists for tuples, Python's numbers for NumPy's."""
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(each) for each in cast(list[Any], value)]
    return value
