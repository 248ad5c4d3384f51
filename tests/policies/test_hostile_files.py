"""Small files that would take gigabytes or hours: each ends in one line, within seconds.

They are made here; none is stored. The tests of each reader have more of them.
"""

import io
import json
import resource
import time
import zipfile
from collections.abc import Callable

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper
from safetensors.numpy import save

from torch_files import saved, state, tensor
from touchdown.core.errors import UserError
from touchdown.policies import lookup

LANDER = "LunarLander-v3"
FLOAT = TensorProto.FLOAT
MOST_SECONDS = 20  # most take a hundredth; a machine that runs other tests is slow


def zipped(**members: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name.replace("_pth", ".pth"), data)
    return file.getvalue()


def many_members(count: int) -> bytes:
    """A directory with one entry many times, each of which takes half a kilobyte of memory."""
    whole = zipped(a=b"")
    start = whole.index(b"PK\x01\x02")
    end = whole.index(b"PK\x05\x06")
    size = (end - start) * count
    trailer = bytearray(whole[end:])
    trailer[8:12] = b"\xff\xff" * 2
    trailer[12:16] = size.to_bytes(4, "little")
    return whole[:start] + whole[start:end] * count + bytes(trailer)


def sb3(data: bytes) -> bytes:
    return zipped(data=data, policy_pth=saved(state()))


def weights(header: dict[str, object] | bytes) -> bytes:
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return len(text).to_bytes(8, "little") + text


def described(network: str) -> bytes:
    metadata = {"format_version": "2", "env_id": LANDER, "network": network}
    return save({"w": np.zeros((100, 100), np.float32)}, metadata)


def model(nodes: list[onnx.NodeProto], initializer: tuple[TensorProto, ...] = ()) -> bytes:
    graph = helper.make_graph(
        nodes,
        "hostile",
        [helper.make_tensor_value_info("o", FLOAT, ["N", 8])],
        [helper.make_tensor_value_info("q", FLOAT, None)],
        initializer,
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    return made.SerializeToString()


def field(number: int, data: bytes) -> bytes:
    """A field of a protocol buffer that holds a message."""
    size, coded = len(data), bytearray()
    while size > 127:
        coded.append(size & 127 | 128)
        size >>= 7
    return bytes([number << 3 | 2]) + bytes(coded) + bytes([size]) + data


def nested(depth: int) -> bytes:
    """Graphs within graphs, which a parser without a limit follows until its stack overflows."""
    graph = b""
    for _ in range(depth):
        graph = field(1, field(5, field(6, graph)))  # in an attribute of a node
    return field(7, graph)


def claiming() -> bytes:
    """A tensor that claims a terabyte and has four bytes."""
    huge = TensorProto(name="w", data_type=FLOAT, dims=[1 << 20, 1 << 18], raw_data=bytes(4))
    return model([helper.make_node("Gather", ["w", "o"], ["q"])], (huge,))


FILES: dict[str, Callable[[], bytes]] = {
    "brackets.zip": lambda: sb3(b'{"policy_class": [' + b"[]," * 3_000_000 + b"[]]}"),
    "deep.zip": lambda: sb3(b'{"x": ' + b"[" * 5_000_000),
    "kwargs.zip": lambda: sb3(b'{"policy_kwargs": {"activation_fn": ["a", "b"]}}'),
    "bomb.zip": lambda: zipped(data=bytes(17 << 20)),
    "members.zip": lambda: many_members(30_000),
    "folder.zip": lambda: zipped(readme=b"not a policy"),
    "numbers.pth": lambda: saved(
        state(**{f"a{n}": tensor((1,), (1,), count=1 << 23) for n in range(9)})
    ),
    "views.pth": lambda: saved(state(a=tensor((1 << 20, 1 << 20), (0, 0)))),
    "bomb.pt": lambda: zipped(**{"x/data.pkl": bytes(2 << 20)}),
    "operations.pt": lambda: zipped(**{"x/data.pkl": b"\x80\x02" + b"}" * 1_000_000 + b"."}),
    "header.safetensors": lambda: (1 << 62).to_bytes(8, "little") + b"{}",
    "null.safetensors": lambda: weights({"__metadata__": None}),
    "list.safetensors": lambda: weights(b"[" * 1_000_000),
    "claims.safetensors": lambda: weights(
        {"w": {"dtype": "F32", "shape": [1 << 40], "data_offsets": [0, 1 << 42]}}
    ),
    "negative.safetensors": lambda: weights(
        {"w": {"dtype": "F32", "shape": [-1], "data_offsets": [0, 4]}}
    ),
    "sizes.safetensors": lambda: described(json.dumps({"hidden_sizes": [1] * 400_000})),
    "wide.safetensors": lambda: described(json.dumps({"hidden_sizes": [100_000] * 99})),
    "lists.safetensors": lambda: described('{"hidden_sizes": [' + "[]," * 300_000 + "[]]}"),
    "brackets.toml": lambda: b"a = " + b"[" * 1_000_000,
    "large.toml": lambda: b"#" * (5 << 20),
    "nested.onnx": lambda: nested(10_000),
    "claiming.onnx": claiming,
    "text.onnx": lambda: model([helper.make_node("Constant", [], ["q"], value_strings=["a"])]),
}


@pytest.mark.parametrize("name", FILES)
def test_a_hostile_file_is_refused_in_one_line_within_time_and_memory(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(FILES[name]())
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.monotonic()
    with pytest.raises(UserError) as refused:
        lookup.load(str(path), LANDER)
    assert time.monotonic() - began < MOST_SECONDS
    assert str(refused.value).startswith(f"{path}")
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 1_000
    # kilobytes on Linux; the highest so far, so only growth beyond it is seen
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000
