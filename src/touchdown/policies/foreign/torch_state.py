"""The arrays of a `torch.save` file, read without PyTorch and without running the file.

The file is a zip archive. Its `data.pkl` is a pickle: a program for a small virtual machine, which
may call any function that it names, so loading a pickle runs it. Here the program is only
interpreted, one operation after the other. Only the operations that a dictionary of arrays needs
are implemented, names are compared as text, and nothing is imported or called; everything else is
refused. The bytes of the arrays are in other members, `data/0`, `data/1` and so on.
"""

import pickletools
from dataclasses import dataclass
from math import prod
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from touchdown.policies.foreign.archive import Archive

_MOST_PROGRAM = 1 << 20  # bytes; a network of a thousand layers needs less
_MOST_NUMBERS = 1 << 26  # in all arrays together
_MOST_DIMENSIONS = 8

_DICTIONARY, _TENSOR = "collections OrderedDict", "torch._utils _rebuild_tensor_v2"
_DTYPES = {  # little-endian; a file in another order says so in `byteorder`
    "torch DoubleStorage": np.dtype("<f8"),
    "torch FloatStorage": np.dtype("<f4"),
    "torch HalfStorage": np.dtype("<f2"),
    "torch LongStorage": np.dtype("<i8"),
}
_NAMES = (_DICTIONARY, _TENSOR, *_DTYPES)


@dataclass(frozen=True, slots=True)
class _Name:
    """A name that the program would import; it is compared, never imported."""

    text: str


@dataclass(frozen=True, slots=True)
class _Storage:
    """The numbers in one member of the archive."""

    dtype: np.dtype[Any]
    key: str
    count: int


@dataclass(frozen=True, slots=True)
class _Tensor:
    """A view of a storage, with a shape and strides."""

    storage: _Storage
    offset: int
    shape: tuple[Any, ...]
    strides: tuple[Any, ...]


_TENSOR_KINDS = (_Storage, int, tuple, tuple)  # types of the arguments that make an array


def read_state(data: bytes) -> dict[str, NDArray[Any]]:
    """The arrays of a state dict, by name.

    Args:
        data: bytes of a `torch.save` file from PyTorch 1.6 or later.

    Returns:
        Each array in its own shape, as floats of 2, 4 or 8 bytes or integers of 8.

    Raises:
        ValueError: the file is broken, too large, or not a state dict.
    """
    archive = Archive(data)
    programs = [name for name in archive.names if name.endswith("/data.pkl")]
    if len(programs) != 1:
        raise ValueError("has no data.pkl, or several; PyTorch 1.6 or later saves one")
    folder = programs[0].removesuffix("data.pkl")
    order = f"{folder}byteorder"
    if order in archive.names and archive.read(order, 16) != b"little":
        raise ValueError("its numbers are not little-endian")
    try:
        state = _read_program(archive.read(programs[0], _MOST_PROGRAM))
    except (IndexError, KeyError, TypeError) as error:
        raise ValueError(f"its data.pkl is broken: {error}") from None
    if not isinstance(state, dict):
        raise ValueError("its data.pkl is not a state dict")
    tensors = {
        name: value
        for name, value in cast(dict[str, object], state).items()
        if isinstance(value, _Tensor)
    }
    if sum(tensor.storage.count for tensor in tensors.values()) > _MOST_NUMBERS:
        raise ValueError(f"its arrays have more than {_MOST_NUMBERS} numbers")
    return {name: _array(archive, folder, tensor) for name, tensor in tensors.items()}


def _read_program(program: bytes) -> object:  # noqa: PLR0912 - one branch per operation
    """The object of a pickle that uses only operations and names of a state dict."""
    stack: list[Any] = []
    marks: list[int] = []
    memo: dict[int, Any] = {}

    def popped(start: int) -> list[Any]:
        items = stack[start:]
        del stack[start:]
        return items

    try:
        operations = list(pickletools.genops(program))
    except ValueError:
        raise ValueError("its data.pkl is not a complete pickle") from None
    for opcode, argument, _ in operations:
        match opcode.name:
            case "PROTO" | "STOP":
                pass
            case "MARK":
                marks.append(len(stack))
            case "BINUNICODE" | "BININT" | "BININT1" | "BININT2" | "LONG1":
                stack.append(argument)
            case "NEWFALSE" | "NEWTRUE" | "NONE":
                stack.append(None)  # requires_grad, which does not matter here
            case "EMPTY_DICT":
                stack.append({})
            case "EMPTY_TUPLE":
                stack.append(())
            case "TUPLE1" | "TUPLE2" | "TUPLE3":
                stack.append(tuple(popped(len(stack) - int(opcode.name[-1]))))
            case "TUPLE":
                stack.append(tuple(popped(marks.pop())))
            case "BINPUT" | "LONG_BINPUT":
                memo[cast(int, argument)] = stack[-1]
            case "BINGET" | "LONG_BINGET":
                stack.append(memo[cast(int, argument)])
            case "GLOBAL":
                stack.append(_name(str(argument)))
            case "BINPERSID":
                stack.append(_storage(stack.pop()))
            case "REDUCE":
                arguments, name = stack.pop(), stack.pop()
                stack.append(_made(name, arguments))
            case "SETITEM":
                _set(stack[-3], popped(len(stack) - 2))
            case "SETITEMS":
                items = popped(marks.pop())
                _set(stack[-1], items)
            case "BUILD":
                stack.pop()  # the versions of the modules
            case _:
                raise ValueError(f"its data.pkl has {opcode.name}, which no state dict needs")
    return stack.pop()


def _name(text: str) -> _Name:
    if text not in _NAMES:
        shown = text.replace(" ", ".")[:80]
        raise ValueError(f"its data.pkl names {shown!r}, which no state dict needs")
    return _Name(text)


def _set(mapping: object, items: list[Any]) -> None:
    if not isinstance(mapping, dict) or len(items) % 2:
        raise TypeError("not a dictionary")
    for key, value in zip(items[::2], items[1::2], strict=True):
        # only text: hashing a deeply nested tuple would overflow the stack
        if not isinstance(key, str):
            raise TypeError("not a name")
        cast(dict[str, object], mapping)[key] = value


def _storage(identity: object) -> _Storage:
    match identity:
        case ("storage", _Name(text=kind), str(key), str(), int(count)) if kind in _DTYPES:
            return _Storage(_DTYPES[kind], key, count)
        case _:
            raise TypeError("not a storage")


def _made(name: object, arguments: object) -> object:
    if not isinstance(name, _Name) or not isinstance(arguments, tuple):
        raise TypeError("not an array")
    if name.text == _DICTIONARY:
        return {}  # later operations fill it
    given = cast(tuple[Any, ...], arguments)
    kinds = [isinstance(each, kind) for each, kind in zip(given, _TENSOR_KINDS, strict=False)]
    if name.text != _TENSOR or kinds != [True] * len(_TENSOR_KINDS):
        raise TypeError("not an array")
    tensor = _Tensor(*given[: len(_TENSOR_KINDS)])
    _check(tensor)
    return tensor


def _check(tensor: _Tensor) -> None:
    """Refuse an array that exceeds its storage, or repeats elements of it."""
    sizes = (tensor.offset, tensor.storage.count, *tensor.shape, *tensor.strides)
    if not all(type(size) is int and 0 <= size <= _MOST_NUMBERS for size in sizes):
        raise ValueError("its data.pkl has an array of an invalid shape, or too large")
    if len(tensor.shape) != len(tensor.strides) or len(tensor.shape) > _MOST_DIMENSIONS:
        raise ValueError("its data.pkl has an array of an invalid shape")
    last = sum((size - 1) * step for size, step in zip(tensor.shape, tensor.strides, strict=True))
    if not 0 < prod(tensor.shape) <= tensor.storage.count > tensor.offset + last:
        raise ValueError("its data.pkl has an array that is empty, or larger than its storage")


def _array(archive: Archive, folder: str, tensor: _Tensor) -> NDArray[Any]:
    storage = tensor.storage
    size = storage.count * storage.dtype.itemsize
    data = archive.read(f"{folder}data/{storage.key}", size)
    if len(data) != size:
        raise ValueError(f"data/{storage.key} has {len(data)} bytes, must be {size}")
    index: NDArray[np.intp] = np.array(tensor.offset)
    for length, step in zip(tensor.shape, tensor.strides, strict=True):
        index = np.add.outer(index, np.arange(int(length)) * int(step))
    return np.frombuffer(data, storage.dtype)[index]
