"""A record with one value changed at a time, as a slip of the hand or a broken disk would do."""

import copy
from typing import Any

from touchdown.core.errors import UserError

WRONG = (None, True, -1, 0.5, 1e300, 10**30, "x", [], {}, [[]])


def single_changes(record: Any):
    """Copies of a record, each with one value gone or another in its place."""
    for place in places(record):
        for wrong in WRONG:
            yield changed(record, place, wrong)
        if place:
            yield without(record, place)


def places(record: Any, place: tuple[str | int, ...] = ()):
    """Where the values of a record are; of a long list the first and the last."""
    yield place
    if isinstance(record, dict):
        for key, value in record.items():
            yield from places(value, (*place, key))
    elif isinstance(record, list):
        for index in sorted({0, len(record) - 1} if record else ()):
            yield from places(record[index], (*place, index))


def changed(record: Any, place: tuple[str | int, ...], value: Any) -> Any:
    """A copy of a record with another value in a place."""
    if not place:
        return value
    other = copy.deepcopy(record)
    inner = other
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return other


def without(record: Any, place: tuple[str | int, ...]) -> Any:
    """A copy of a record without the value in a place."""
    other = copy.deepcopy(record)
    inner = other
    for key in place[:-1]:
        inner = inner[key]
    del inner[place[-1]]
    return other


def is_refused_in_a_line(read, where: str) -> bool:
    """Whether a record is refused; a refusal is a UserError of one line that names the file."""
    refusal = None
    try:
        read()
    except UserError as error:
        refusal = str(error)
    assert refusal is None or (where in refusal and "\n" not in refusal)
    return refusal is not None
