"""The process that loads and runs a stranger's ONNX model, within limits.

`worker_model.py` starts it and talks to it through pipes. A message is the sizes of its two parts,
JSON and the bytes of an array, each as four bytes, and then the parts. A model
that fails or crashes ends only this process.
"""

import json
import os
import signal
import struct
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from stat import S_ISREG
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from touchdown.core import limits, processes
from touchdown.policies.foreign.onnx_session import Session

SIZES = struct.Struct("<II")
MOST_JSON = limits.MIB
"""Bytes of JSON in a message."""
_MOST_ERROR = 500  # characters
_MOST_PORTS = 20  # inputs or outputs that are described
_MOST_NAME = 100  # characters of a name, a type or an environment's id
_SLACK = 2.0  # times the limit, after which this process ends itself if nobody does
_EMPTY = np.zeros(0, np.uint8)


def main() -> None:
    """Serve one model until standard input is closed: `PATH PARENT MEMORY LOAD ACT`."""
    path, parent = sys.argv[1], int(sys.argv[2])
    memory, load_seconds, act_seconds = int(sys.argv[3]), *map(float, sys.argv[4:6])
    threading.Thread(target=processes.end_with, args=(parent,), daemon=True).start()
    try:
        with _Alarm(load_seconds):
            _limit(memory)
            _check(path)
            session = Session(path)
        _reply(_describe(session))
    except (ValueError, MemoryError, OSError) as error:
        _reply({"error": _text(error)})
        return
    while True:
        request, data = _receive()
        observations = np.frombuffer(data, np.float32).reshape(request["shape"])
        try:
            with _Alarm(act_seconds):
                answer, result = _run(session, observations, request.get("output"))
            _reply(answer, result)
        except (ValueError, MemoryError) as error:
            _reply({"error": _text(error)})


def _run(
    session: Session, observations: NDArray[np.float32], output: str | None
) -> tuple[dict[str, Any], NDArray[Any]]:
    """The array of one output, or the type and shape of every output that is an array."""
    if output is None:
        results = zip(session.outputs, session.run(observations), strict=True)
        named = [
            (port.name, cast(NDArray[Any], result))
            for port, result in results
            if isinstance(result, np.ndarray)
        ]
        arrays = [(name, array.dtype.str, list(array.shape)) for name, array in named]
        return {"results": arrays[:_MOST_PORTS]}, _EMPTY
    (result,) = session.run(observations, [output])
    array = cast(NDArray[Any], result)
    if array.nbytes > limits.ONNX_RESULT_BYTES:
        raise ValueError(f"returns too large a value as {output[:_MOST_NAME]}")
    return {"dtype": array.dtype.str, "shape": list(array.shape)}, np.ascontiguousarray(array)


def _describe(session: Session) -> dict[str, Any]:
    return {
        "inputs": [
            (port.type[:_MOST_NAME], port.shape[:_MOST_PORTS])
            for port in session.inputs[:_MOST_PORTS]
        ],
        "env_id": session.metadata.get("env_id", "")[: _MOST_NAME + 1],
    }


def _limit(memory: int) -> None:
    """Limit the memory of this process; it writes no file and no core dump."""
    import resource  # noqa: PLC0415 - not on Windows

    wanted = {resource.RLIMIT_AS: memory, resource.RLIMIT_CORE: 0, resource.RLIMIT_FSIZE: 0}
    for kind, most in wanted.items():
        _, hard = resource.getrlimit(kind)
        allowed = most if hard == resource.RLIM_INFINITY else min(most, hard)
        try:
            resource.setrlimit(kind, (allowed, allowed))
        except (OSError, ValueError):  # macOS has no limit on the address space
            continue


def _check(path: str) -> None:
    """Refuse a model that is too large, or whose weights are in something else than a file.

    Raises:
        ValueError: it is refused.
    """
    import onnx  # noqa: PLC0415 - after the limits are set
    from google.protobuf.message import DecodeError  # noqa: PLC0415 - as above

    data = Path(path).read_bytes()
    try:
        model: Any = onnx.ModelProto.FromString(data)
    except DecodeError as error:
        raise ValueError(f"not a complete ONNX model: {_text(error)}") from None
    size, nodes, tensors = len(data), 0, 0
    external: dict[str, int] = {}
    for graph_nodes, graph_tensors in _graphs(model):
        nodes, tensors = nodes + len(graph_nodes), tensors + len(graph_tensors)
        if nodes > limits.ONNX_NODES or tensors > limits.ONNX_TENSORS:
            raise ValueError(
                f"has more than {limits.ONNX_NODES} nodes or {limits.ONNX_TENSORS} tensors"
            )
        for tensor in graph_tensors:
            if tensor.data_location == onnx.TensorProto.EXTERNAL:
                where = {entry.key: entry.value for entry in tensor.external_data}
                location = where.get("location", "")
                external[location] = _size_of(Path(path).parent, location)
    size += sum(external.values())
    if size > limits.ONNX_BYTES:
        raise ValueError(f"has {size} bytes of weights, must be at most {limits.ONNX_BYTES}")


def _graphs(model: Any) -> Iterator[tuple[Any, list[Any]]]:
    """The nodes and the tensors of each graph, nested ones too."""
    waiting = [model.graph, *model.functions]
    while waiting:
        graph = waiting.pop()
        tensors = list(getattr(graph, "initializer", ()))
        for sparse in getattr(graph, "sparse_initializer", ()):
            tensors += (sparse.values, sparse.indices)
        for node in graph.node:
            for attribute in node.attribute:
                waiting.extend(attribute.graphs)
                tensors.extend(attribute.tensors)
                if attribute.HasField("g"):
                    waiting.append(attribute.g)
                if attribute.HasField("t"):
                    tensors.append(attribute.t)
        yield graph.node, tensors


def _size_of(folder: Path, location: str) -> int:
    """The size of a file of weights beside the model."""
    name = Path(location)
    if not location or name.is_absolute() or ".." in name.parts:
        raise ValueError(f"weights in {location[:_MOST_NAME]!r}: must be in the model's folder")
    try:
        facts = (folder / name).stat()
    except (OSError, ValueError):
        raise ValueError(f"not a complete ONNX model: weights in {name}: no such file") from None
    if not S_ISREG(facts.st_mode):
        raise ValueError(f"weights in {name}: must be a regular file")
    return facts.st_size


class _Alarm:
    """Ends this process if the block takes far too long, even if nobody waits for it any more."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds * _SLACK

    def __enter__(self) -> None:
        signal.setitimer(signal.ITIMER_REAL, self._seconds)

    def __exit__(self, *_: object) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0)


def _text(error: BaseException) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text[:_MOST_ERROR]


def _receive() -> tuple[dict[str, Any], bytes]:
    first = sys.stdin.buffer.read(SIZES.size)
    if len(first) < SIZES.size:
        os._exit(0)
    of_json, of_data = SIZES.unpack(first)
    return json.loads(sys.stdin.buffer.read(of_json)), sys.stdin.buffer.read(of_data)


def _reply(answer: dict[str, Any], array: NDArray[Any] = _EMPTY) -> None:
    text = json.dumps(answer).encode()
    sys.stdout.buffer.write(SIZES.pack(len(text), array.nbytes) + text + array.tobytes())
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
