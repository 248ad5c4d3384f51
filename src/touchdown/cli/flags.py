"""The words that each verb takes, read from its dataclass: for help texts and error messages."""

import ast
import inspect
import textwrap
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Union, cast

from tyro import conf

from touchdown.config.sections import SECTIONS

_MARKS = {name: typing.get_args(getattr(conf, name)[int])[1] for name in ("Positional", "Fixed")}
_METAVARS: Mapping[Any, str] = {int: "INT", float: "FLOAT", str: "TEXT", Path: "PATH"}


@dataclass(frozen=True, slots=True)
class Flag:
    """One flag, or one word without a flag."""

    name: str
    """Name of its field, such as `learning_rate`."""
    section: str
    """Section of the config that it belongs to, such as `learning`; "" if there is none."""
    text: str
    metavar: str
    """What stands for its value; "" for a switch, which takes none."""
    default: Any
    """`MISSING` if it must be given."""
    is_positional: bool
    takes_many: bool

    @property
    def word(self) -> str:
        """What is typed, such as `--learning-rate`."""
        return self.metavar if self.is_positional else f"--{self.name.replace('_', '-')}"

    @property
    def is_switch(self) -> bool:
        """Whether it takes no value."""
        return not self.metavar

    @property
    def is_required(self) -> bool:
        """Whether it must be given."""
        return self.default is MISSING

    @property
    def words(self) -> tuple[str, ...]:
        """All that can be typed for it: a switch can also be turned off."""
        return (self.word, f"--no-{self.word[2:]}") if self.is_switch else (self.word,)


def flags_of(kind: type[Any]) -> list[Flag]:
    """The flags of a verb, or of a section of the config, in order.

    Args:
        kind: the dataclass of a verb; a field that is a section stands for the section's fields.
    """
    return list(_flags_of(kind))


@cache
def _flags_of(kind: type[Any], section: str = "") -> tuple[Flag, ...]:
    return tuple(_each_flag(kind, section))


def _each_flag(kind: type[Any], section: str) -> Iterator[Flag]:
    hints = typing.get_type_hints(kind, include_extras=True)
    texts = _texts_below_fields(kind) if section else {}
    for item in fields(kind):
        if item.name in SECTIONS:
            yield from _flags_of(SECTIONS[item.name], item.name)
            continue
        of, *marks = typing.get_args(hints[item.name]) or (hints[item.name],)
        if typing.get_origin(hints[item.name]) is not Annotated:
            of, marks = hints[item.name], []
        if _MARKS["Fixed"] in marks:
            continue
        described = next((mark for mark in marks if hasattr(mark, "metavar")), None)
        text = texts.get(item.name) or (described.help if described else "")
        metavar, takes_many = _metavar_of(of)
        yield Flag(
            item.name,
            section,
            " ".join(text.split()),
            (described.metavar if described else None) or metavar,
            item.default_factory() if item.default_factory is not MISSING else item.default,
            _MARKS["Positional"] in marks,
            takes_many,
        )


def choices_of(kind: Any) -> tuple[str, ...]:
    """The values of a type that has only some; () for other types."""
    if typing.get_origin(kind) is Literal:
        return typing.get_args(kind)
    return ()


def without_none(kind: Any) -> Any:
    """The type of a value that may be None."""
    if typing.get_origin(kind) in (Union, types.UnionType):
        return next(each for each in typing.get_args(kind) if each is not type(None))
    return kind


def _metavar_of(kind: Any) -> tuple[str, bool]:
    """What stands for a value of a type in help texts, and whether several may be given."""
    kind = without_none(kind)
    if typing.get_origin(kind) is Annotated:
        return _metavar_of(typing.get_args(kind)[0])
    if typing.get_origin(kind) is tuple:
        of, _ = _metavar_of(typing.get_args(kind)[0])
        return f"{of} ...", True
    if kind is bool:
        return "", False
    return "|".join(choices_of(kind)) or _METAVARS[kind], False


def _texts_below_fields(kind: type[Any]) -> dict[str, str]:
    """The string below each field of a class; none where the sources are not installed."""
    try:
        source = inspect.getsource(kind)
    except OSError:
        return {}
    (tree,) = ast.parse(textwrap.dedent(source)).body
    body = cast(ast.ClassDef, tree).body
    return {
        item.target.id: below.value.value
        for item, below in pairwise(body)
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
        and isinstance(below.value.value, str)
    }
