"""Users' own code by name, `module:Name`, imported only with their permission.

A name may come from a file, such as a run or weights from someone else, and importing it would run
their code. So a name is only imported if the user wrote it, in a call or on the command line, or
explicitly trusts files.
"""

import contextlib
import importlib
import os
import re
import sys
from collections.abc import Generator
from contextvars import ContextVar
from functools import reduce
from itertools import count
from typing import Any, cast

from touchdown.core.errors import UserError, one_line

_NAME = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[\w./-]+")
_named: set[str] = set()
_given: dict[str, Any] = {}
_trusting: ContextVar[bool] = ContextVar("trusting", default=False)


def is_plugin(name: str) -> bool:
    """Whether a name has the form `module:Name`, even if it is not well-formed."""
    return ":" in name


def allow(*names: str) -> None:
    """Allow names to be imported from now on."""
    _named.update(filter(is_plugin, names))


def write(name: str) -> None:
    """Allow a name to be imported, because the user wrote it in a call.

    The name then refers to the importable class or function, even if another object was passed
    under this name before.
    """
    allow(name)
    if _NAME.fullmatch(name):
        _given.pop(name, None)


def give(value: Any, name: str = "") -> str:
    """Register a class or function that the user passed, and return the name by which it is found.

    Args:
        value: the class or function.
        name: its name; "" uses `module:Name` from its definition. A local function or a lambda gets
            a number, because another one may have the same name.
    """
    if not name:
        kind = cast(type[Any], type(value))
        module = getattr(value, "__module__", kind.__module__)
        name = f"{module}:{getattr(value, '__qualname__', f'{kind.__qualname__}()')}"
        if is_local(name):
            same = (f"{name}{number}" for number in count(1))
            name = next(each for each in same if _given.get(each, value) is value)
    _given[name] = value
    allow(name)
    return name


@contextlib.contextmanager
def trusting(*, everything: bool) -> Generator[None]:
    """Within the block, every name may be imported if `everything` is True."""
    token = _trusting.set(everything or _trusting.get())
    try:
        yield
    finally:
        _trusting.reset(token)


def is_local(name: str) -> bool:
    """Whether a name is that of a local function or an object, which no other process can find."""
    return "<" in name or "()" in name


def check_allowed(name: str, where: str) -> None:
    """Refuse a name that only a file names.

    Args:
        name: `module:Name`.
        where: the field that has it, such as `env_id`.

    Raises:
        UserError: the user did not name it and did not pass trust, or it is malformed.
    """
    if name in _given:
        return
    if is_local(name):
        raise UserError(
            f"{where} = {name!r}: is a local function or an object, which only the process that "
            "made it can find; resume the run in Python and pass it again"
        )
    if not _NAME.fullmatch(name):
        raise UserError(f"{where} = {name!r}: must be of the form package.module:Name")
    if name not in _named and not _trusting.get():
        raise UserError(
            f"{where} = {name!r}: names code that would be imported; if you trust it, pass --trust "
            "(in Python: trust=True)"
        )


def module_of(name: str, where: str) -> Any:
    """Import the module of `module:Name`; the current folder is searched last.

    Args:
        name: `module:Name`.
        where: the field that contains it, for errors.

    Raises:
        UserError: it is not allowed, or cannot be imported.
    """
    check_allowed(name, where)
    module = name.partition(":")[0]
    here = os.getcwd()  # noqa: PTH109 - the same form as in sys.path
    if here not in sys.path and "" not in sys.path:
        sys.path.append(here)
    try:
        return importlib.import_module(module)
    except (Exception, SystemExit) as error:  # a user's module may raise anything
        raise UserError(
            f"{where} = {name!r}: module {module} cannot be imported: "
            f"{type(error).__name__}: {one_line(error)}"
        ) from error


def is_given(name: str) -> bool:
    """Whether the user passed an object with this name."""
    return name in _given


def load(name: str, where: str) -> Any:
    """Load `module:Name`: the object that the user passed, or the module's attribute.

    Args:
        name: `module:Name`.
        where: the field that contains it, for errors.

    Raises:
        UserError: it is not allowed, or there is no such module or attribute.
    """
    if name in _given:
        return _given[name]
    module = module_of(name, where)
    attribute = name.partition(":")[2]
    try:
        return reduce(getattr, attribute.split("."), module)
    except AttributeError:
        raise UserError(
            f"{where} = {name!r}: module {module.__name__} has no {attribute!r}"
        ) from None
