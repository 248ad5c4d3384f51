"""Files as `torch.save` writes them, made without PyTorch."""

import io
import zipfile
from collections.abc import Mapping

import numpy as np


def text(value: str) -> bytes:
    """A string in a pickle."""
    data = value.encode()
    return b"X" + len(data).to_bytes(4, "little") + data


def number(value: int) -> bytes:
    """A whole number in a pickle."""
    return b"J" + value.to_bytes(4, "little", signed=True)


def numbers(values: tuple[int, ...]) -> bytes:
    """A tuple of whole numbers in a pickle."""
    return b"(" + b"".join(map(number, values)) + b"t"


def tensor(
    shape: tuple[int, ...],
    strides: tuple[int, ...],
    *,
    offset: int = 0,
    storage: str = "FloatStorage",
    key: str = "0",
    count: int = 6,
) -> bytes:
    """The operations that make one array, as PyTorch writes them."""
    return (
        b"ctorch._utils\n_rebuild_tensor_v2\n(("
        + text("storage")
        + f"ctorch\n{storage}\n".encode()
        + text(key)
        + text("cuda:0")
        + number(count)
        + b"tQ"
        + number(offset)
        + numbers(shape)
        + numbers(strides)
        + b"\x89ccollections\nOrderedDict\n)RtR"
    )


def state(**tensors: bytes) -> bytes:
    """The program of a state dict."""
    items = b"".join(text(name) + operations for name, operations in tensors.items())
    return b"\x80\x02ccollections\nOrderedDict\n)R(" + items + b"u."


def saved(program: bytes, **members: bytes) -> bytes:
    """A file of torch.save, its six numbers 0 to 5 if no others are given."""
    file = io.BytesIO()
    content = {"data/0": np.arange(6, dtype="<f4").tobytes(), **members}
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("x/data.pkl", program)
        for name, data in content.items():
            archive.writestr(f"x/{name}", data)
    return file.getvalue()


def saved_state(arrays: Mapping[str, np.ndarray], entry: str = "") -> bytes:
    """A file of a state dict of these arrays, as an entry of a dictionary if that is named."""
    made = {
        name: tensor(
            array.shape,
            tuple(step // 4 for step in array.strides),
            key=str(index),
            count=array.size,
        )
        for index, (name, array) in enumerate(arrays.items())
    }
    program = state(**made)
    if entry:
        inner = program.removeprefix(b"\x80\x02").removesuffix(b".")
        program = b"\x80\x02}(" + text(entry) + inner + text("args") + b"}u."
    members = {f"data/{index}": array.tobytes() for index, array in enumerate(arrays.values())}
    return saved(program, **members)
