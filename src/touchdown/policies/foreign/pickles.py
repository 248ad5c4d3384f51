"""Reads plain values out of a pickle without unpickling it.

A pickle is a program for a small virtual machine, which may call any function that it names, so
loading a pickle runs it. Here the program is only interpreted, one operation after the other. Names
stay text, and a call becomes a record of the call: nothing is imported or called. Operations that
PyTorch and NumPy do not write are refused.
"""

import pickletools
from dataclasses import dataclass, field
from typing import Any, cast

from touchdown.core import limits

_PUSHED = (
    *("BINUNICODE", "SHORT_BINUNICODE", "BINBYTES", "SHORT_BINBYTES", "BYTEARRAY8", "BINBYTES8"),
    *("BININT", "BININT1", "BININT2", "LONG1", "BINFLOAT"),
)
_CONSTANTS = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False}
_IGNORED = ("PROTO", "FRAME", "STOP")


@dataclass(frozen=True, slots=True)
class Name:
    """A name that the program would import, such as `numpy dtype`."""

    text: str


@dataclass(slots=True, eq=False)
class Made:
    """What the program would have made by a call."""

    name: Name
    arguments: tuple[Any, ...]
    state: Any = None
    """What it would have been given afterwards."""
    items: dict[str | int, Any] = field(default_factory=dict[str | int, Any])
    """Entries, if it is a mapping."""


@dataclass(frozen=True, slots=True)
class Persistent:
    """What the program would have asked its file for."""

    identity: Any


def read(program: bytes, where: str, names: frozenset[str] | None = None) -> Any:
    """The value of a pickle: plain values, `Name`, `Made` and `Persistent`.

    Args:
        program: the pickle.
        where: what it is, for error messages.
        names: the names that it may have; None accepts every name, as none is used.

    Raises:
        ValueError: it is too large, broken, or has a name or an operation that is not accepted.
    """
    if len(program) > limits.PICKLE_BYTES:
        raise ValueError(f"{where} has {len(program)} bytes, must be at most {limits.PICKLE_BYTES}")
    machine = _Machine(where, names)
    try:
        for opcode, argument, _ in pickletools.genops(program):
            machine.do(opcode.name, argument)
        return machine.stack.pop()
    except _RefusedError as error:
        raise ValueError(f"{where} {error}") from None
    except (IndexError, KeyError, TypeError) as error:
        raise ValueError(f"{where} is broken: {error}") from None
    except ValueError:
        raise ValueError(f"{where} is not a complete pickle") from None


class _RefusedError(ValueError):
    """The program has something that no file of weights or statistics needs."""


class _Machine:
    """The stack and the memory of a program."""

    def __init__(self, where: str, names: frozenset[str] | None) -> None:
        self.stack: list[Any] = []
        self._where, self._names = where, names
        self._marks: list[int] = []
        self._memo: dict[int, Any] = {}

    def do(  # noqa: PLR0912, PLR0915 - one branch per operation
        self, name: str, argument: Any
    ) -> None:
        """Interpret one operation."""
        stack = self.stack
        match name:
            case _ if name in _IGNORED:
                pass
            case _ if name in _PUSHED:
                stack.append(argument)
            case _ if name in _CONSTANTS:
                stack.append(_CONSTANTS[name])
            case "MARK":
                self._marks.append(len(stack))
            case "EMPTY_DICT":
                stack.append({})
            case "EMPTY_LIST":
                stack.append([])
            case "EMPTY_TUPLE":
                stack.append(())
            case "TUPLE1" | "TUPLE2" | "TUPLE3":
                stack.append(tuple(self._popped(len(stack) - int(name[-1]))))
            case "TUPLE":
                stack.append(tuple(self._popped(self._marks.pop())))
            case "MEMOIZE":
                self._memo[len(self._memo)] = stack[-1]
            case "BINPUT" | "LONG_BINPUT":
                self._memo[argument] = stack[-1]
            case "BINGET" | "LONG_BINGET":
                stack.append(self._memo[argument])
            case "GLOBAL":
                stack.append(self._name(argument))
            case "STACK_GLOBAL":
                stack.append(self._name(" ".join(self._popped(len(stack) - 2))))
            case "BINPERSID":
                stack.append(Persistent(stack.pop()))
            case "REDUCE" | "NEWOBJ":
                arguments, made = stack.pop(), stack.pop()
                if not isinstance(made, Name) or not isinstance(arguments, tuple):
                    raise TypeError("not a call")
                stack.append(Made(made, cast(tuple[Any, ...], arguments)))
            case "BUILD":
                state = stack.pop()
                if isinstance(stack[-1], Made):
                    stack[-1].state = state
            case "APPEND" | "APPENDS":
                start = len(stack) - 1 if name == "APPEND" else self._marks.pop()
                items = self._popped(start)
                if isinstance(stack[-1], list):
                    stack[-1].extend(items)
            case "SETITEM" | "SETITEMS":
                start = len(stack) - 2 if name == "SETITEM" else self._marks.pop()
                items = self._popped(start)
                _set(stack[-1], items)
            case _:
                raise _RefusedError(f"has {name}, which is not needed")

    def _popped(self, start: int) -> list[Any]:
        items = self.stack[start:]
        del self.stack[start:]
        return items

    def _name(self, text: str) -> Name:
        if self._names is not None and text not in self._names:
            shown = text.replace(" ", ".")[:80]
            raise _RefusedError(f"names {shown!r}, which is not needed")
        return Name(text)


def _set(holder: Any, items: list[Any]) -> None:
    mapping = holder.items if isinstance(holder, Made) else holder
    if not isinstance(mapping, dict) or len(items) % 2:
        raise TypeError("not a dictionary")
    for key, value in zip(items[::2], items[1::2], strict=True):
        # nothing else: hashing a deeply nested tuple would overflow the stack
        if not isinstance(key, str | int):
            raise TypeError("not a name")
        cast(dict[str | int, Any], mapping)[key] = value


def sizes(value: Any) -> tuple[int, ...]:
    """A shape or strides, whose numbers are not checked yet.

    Raises:
        ValueError: it is not a tuple.
    """
    if not isinstance(value, tuple):
        raise ValueError("an array has an invalid shape")
    return cast(tuple[int, ...], value)
