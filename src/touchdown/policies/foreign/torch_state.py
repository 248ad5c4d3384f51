"""The arrays of a `torch.save` file, read without PyTorch and without running the file.

The file is a zip archive. Its `data.pkl` is a pickle, which is only interpreted (`pickles.py`). The
bytes of the arrays are in other members, `data/0`, `data/1` and so on.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from touchdown.core import limits
from touchdown.policies.foreign import pickles
from touchdown.policies.foreign.archive import Archive
from touchdown.policies.foreign.pickles import Made, Name, Persistent

_DICTIONARY, _TENSOR = "collections OrderedDict", "torch._utils _rebuild_tensor_v2"
_DTYPES = {  # little-endian; a file in another order says so in `byteorder`
    "torch DoubleStorage": np.dtype("<f8"),
    "torch FloatStorage": np.dtype("<f4"),
    "torch HalfStorage": np.dtype("<f2"),
    "torch LongStorage": np.dtype("<i8"),
}
_NAMES = frozenset((_DICTIONARY, _TENSOR, *_DTYPES))


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
    shape: tuple[int, ...]
    strides: tuple[int, ...]


def read_state(data: bytes) -> dict[str, NDArray[Any]]:
    """The arrays of a state dict, by name.

    The arrays of a state dict within a dictionary have the name of its entry before their own,
    such as `model_weights.network.0.weight`.

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
    program = archive.read(programs[0], limits.PICKLE_BYTES)
    state = _items(pickles.read(program, "its data.pkl", _NAMES))
    if state is None:
        raise ValueError("its data.pkl is not a state dict")
    tensors = dict(_tensors(state))
    if sum(tensor.storage.count for tensor in tensors.values()) > limits.PICKLE_NUMBERS:
        raise ValueError(f"its arrays have more than {limits.PICKLE_NUMBERS} numbers")
    return {name: _array(archive, folder, tensor) for name, tensor in tensors.items()}


def _items(value: Any) -> dict[str | int, Any] | None:
    """The entries of a dictionary, ordered or not; None of anything else."""
    if isinstance(value, Made) and value.name.text == _DICTIONARY:
        return value.items
    return cast(dict[str | int, Any], value) if isinstance(value, dict) else None


def _tensors(state: dict[str | int, Any]) -> Iterator[tuple[str, _Tensor]]:
    for name, value in state.items():
        inner = _items(value)
        for path, each in [(str(name), value)] if inner is None else _within(name, inner):
            if isinstance(each, Made) and each.name.text == _TENSOR:
                yield path, _tensor(each)


def _within(name: str | int, inner: dict[str | int, Any]) -> list[tuple[str, Any]]:
    return [(f"{name}.{of_inner}", value) for of_inner, value in inner.items()]


def _tensor(made: Made) -> _Tensor:
    """An array that does not exceed its storage and does not repeat elements of it."""
    match made.arguments[:4]:
        case (
            Persistent(("storage", Name(text=kind), str(key), str(), int(count))),
            int(offset),
            shape,
            strides,
        ) if kind in _DTYPES:
            storage = _Storage(_DTYPES[kind], key, count)
            tensor = _Tensor(storage, offset, pickles.sizes(shape), pickles.sizes(strides))
        case _:
            raise ValueError("its data.pkl has an array of an unknown kind")
    shape, strides = tensor.shape, tensor.strides
    sizes = (offset, count, *shape, *strides)
    if not all(type(size) is int and 0 <= size <= limits.PICKLE_NUMBERS for size in sizes):
        raise ValueError("its data.pkl has an array of an invalid shape, or too large")
    if len(shape) != len(strides) or len(shape) > limits.ARRAY_DIMENSIONS:
        raise ValueError("its data.pkl has an array of an invalid shape")
    last = sum((size - 1) * step for size, step in zip(shape, strides, strict=True))
    if not 0 < prod(shape) <= count > offset + last:
        raise ValueError("its data.pkl has an array that is empty, or larger than its storage")
    return tensor


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
