"""How the text of a flag's value becomes a number, a choice or a list, and how it is refused."""

import re
import typing
from collections.abc import Callable, Sequence
from typing import Any, Literal

from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from touchdown.cli.flags import choices_of, without_none
from touchdown.core.names import hint

_EXACT = 2**53  # larger whole numbers written as 1e20 may be others than the reader thinks


def registry() -> ConstructorRegistry:
    """The rules for tyro: of whole numbers, numbers, choices, and lists of them."""
    rules = ConstructorRegistry()
    rules.primitive_rule(_rule)
    return rules


def whole_number(text: str) -> int:
    """A whole number, also from 1e5, 100_000 or 64.0.

    Raises:
        ValueError: it is something else.
    """
    try:
        return int(text)
    except ValueError:
        refusal = ValueError(f"{_shown(text)}: must be a whole number, such as 100000 or 1e5")
    try:
        value = float(text)
    except ValueError:
        raise refusal from None
    if not value.is_integer() or abs(value) >= _EXACT:  # neither infinity nor NaN is an integer
        raise refusal
    return int(value)


def number(text: str) -> float:
    """A number; the field decides whether it may be infinite.

    Raises:
        ValueError: it is something else.
    """
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{_shown(text)}: must be a number, such as 0.001 or 1e-3") from None


def _shown(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:57]}...")


def _choice(choices: Sequence[str]) -> Callable[[str], str]:
    def read(text: str) -> str:
        if text not in choices:
            raise ValueError(f"{_shown(text)}: {hint(text, choices)}")
        return text

    return read


def _reader_of(kind: Any) -> Callable[[str], Any] | None:
    """What reads one value of a type; None if tyro's own rule does."""
    if kind is int:
        return whole_number
    if kind is float:
        return number
    return _choice(choices_of(kind)) if typing.get_origin(kind) is Literal else None


def _parts(words: Sequence[str]) -> list[str]:
    """The values of a list: `64 64`, `64,64`, or `[64, 64]` as in Python."""
    text = " ".join(words).strip()
    inner = text.strip("[( )]")
    return [] if text and not inner else re.split(r"\s*,\s*|\s+", inner)


def _rule(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    kind = without_none(info.type)
    may_be_none = kind is not info.type
    many = typing.get_origin(kind) is tuple
    read = _reader_of(typing.get_args(kind)[0] if many else kind)
    if read is None:
        return None

    def from_words(words: list[str]) -> Any:
        if may_be_none and words == ["None"]:
            return None
        values = [read(part) for part in (_parts(words) if many else words)]
        return tuple(values) if many else values[0]

    return PrimitiveConstructorSpec(
        nargs="*" if many else 1,
        metavar="",  # help texts are ours
        instance_from_str=from_words,
        is_instance=lambda _: True,
        str_from_instance=lambda value: [str(value)],
    )
