"""A stranger's ONNX model, run in another process within limits of memory and time."""

import json
import os
import select
import signal
import subprocess
import sys
import time
import weakref
from pathlib import Path
from typing import Any, NamedTuple, cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from touchdown.core import limits, reading
from touchdown.core.errors import UserError, one_line
from touchdown.core.limits import WorkerLimits
from touchdown.policies.foreign.onnx_worker import MOST_JSON, SIZES

_WORKER = "touchdown.policies.foreign.onnx_worker"
_DTYPES = ("<f2", "<f4", "<f8", "|i1", "<i2", "<i4", "<i8", "|u1", "<u2", "<u4", "<u8", "|b1")


class Input(NamedTuple):
    """An input of a model."""

    type: str
    """As onnxruntime writes it, such as `tensor(float)`."""
    shape: list[int | str | None]
    """An open dimension is not an integer."""


class Result(NamedTuple):
    """What one output of a model is."""

    name: str
    dtype: str
    shape: list[int]


class _Loaded(msgspec.Struct):
    inputs: list[tuple[str, list[int | str | None]]]
    env_id: str


class _Results(msgspec.Struct):
    results: list[tuple[str, str, list[int]]]


class _Array(msgspec.Struct):
    dtype: str
    shape: list[int]


class _Refused(msgspec.Struct):
    error: str | None = None


class WorkerModel:
    """A model that another process has loaded.

    The process ends with this object, with this process, and when it exceeds a limit.

    Args:
        path: the `.onnx` file.
        bounds: limits of the process.

    Raises:
        UserError: the file is not a regular one or is too large, the model is broken, or it exceeds
            a limit.
    """

    def __init__(self, path: Path, bounds: WorkerLimits = WorkerLimits()) -> None:  # noqa: B008 - frozen
        reading.check_regular(path, limits.ONNX_BYTES)
        self._path, self._bounds = path, bounds
        loaded = self._start()
        self.inputs = [Input(*each) for each in loaded.inputs]
        """The first inputs."""
        self.env_id = loaded.env_id
        """The environment that the metadata of the model names; else ""."""

    def results(self, observations: NDArray[np.float32]) -> list[Result]:
        """What each output is that is an array, found by running the model.

        Args:
            observations: [B, D].

        Raises:
            UserError: the model cannot be computed, or exceeds a limit.
        """
        answer, _ = self._ask({"shape": observations.shape}, observations)
        return [Result(*each) for each in self._decoded(answer, _Results).results]

    def run(self, observations: NDArray[np.float32], output: str) -> NDArray[Any]:
        """The array of one output.

        Args:
            observations: [B, D].
            output: its name.

        Raises:
            UserError: the model cannot be computed, or exceeds a limit.
        """
        answer, data = self._ask({"shape": observations.shape, "output": output}, observations)
        array = self._decoded(answer, _Array)
        try:
            if array.dtype not in _DTYPES:
                raise ValueError(f"dtype {array.dtype!r}")
            return np.frombuffer(data, array.dtype).reshape(array.shape)
        except ValueError as error:
            raise UserError(f"{self._path}: cannot be computed: {one_line(error)}") from None

    def _start(self) -> _Loaded:
        bounds = self._bounds
        arguments = [os.getpid(), bounds.memory, bounds.load_seconds, bounds.act_seconds]
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own program
                # without the current folder, where a stranger's modules may be
                [sys.executable, "-PB", "-m", _WORKER, str(self._path), *map(str, arguments)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
                start_new_session=True,  # Ctrl-C is handled here
                bufsize=0,
            )
        except OSError as error:
            raise UserError(f"{self._path}: no process can be started: {one_line(error)}") from None
        self._owner = os.getpid()
        self._end = weakref.finalize(self, _end, self._process, self._owner)
        answer, _ = self._receive("load", bounds.load_seconds)
        return self._decoded(answer, _Loaded)

    def _ask(self, request: dict[str, Any], data: NDArray[Any]) -> tuple[bytes, bytes]:
        if os.getpid() != self._owner:  # a fork; the pipes are its parent's
            self._end.detach()
            self._start()
        text = json.dumps(request).encode()
        message = SIZES.pack(len(text), data.nbytes) + text + np.ascontiguousarray(data).tobytes()
        pipe: int = cast(Any, self._process.stdin).fileno() if self._end.alive else -1
        try:
            while message:
                message = message[os.write(pipe, message) :]
        except OSError:
            raise self._died("compute an action") from None
        return self._receive("compute an action", self._bounds.act_seconds)

    def _receive(self, task: str, seconds: float) -> tuple[bytes, bytes]:
        deadline = time.monotonic() + seconds
        sizes = self._read(SIZES.size, task, deadline, seconds)
        of_json, of_data = SIZES.unpack(sizes)
        if of_json > MOST_JSON or of_data > limits.ONNX_RESULT_BYTES:
            raise self._died(task)
        answer = self._read(of_json, task, deadline, seconds)
        data = self._read(of_data, task, deadline, seconds)
        try:
            error = msgspec.json.decode(answer, type=_Refused).error
        except ValueError:
            raise self._died(task) from None
        if error is not None:
            raise UserError(f"{self._path}: {' '.join(error.split())}")
        return answer, data

    def _read(self, size: int, task: str, deadline: float, seconds: float) -> bytes:
        pipe: int = cast(Any, self._process.stdout).fileno()
        poll = select.poll()
        poll.register(pipe, select.POLLIN)
        parts: list[bytes] = []
        while size:
            if not poll.poll(max(0.0, deadline - time.monotonic()) * 1_000):
                self._end()
                raise UserError(
                    f"{self._path}: needs more than {seconds:g} seconds to {task}, which is the "
                    "limit"
                )
            part = os.read(pipe, size)
            if not part:
                raise self._died(task)
            parts.append(part)
            size -= len(part)
        return b"".join(parts)

    def _died(self, task: str) -> UserError:
        """The refusal of a model that ended its process."""
        process = self._process
        try:
            status = process.wait(timeout=1)
        except subprocess.TimeoutExpired:
            status = 0
        self._end()
        reason = f"exit status {status}"
        if status < 0:
            reason = f"signal {signal.Signals(-status).name}"
        return UserError(
            f"{self._path}: ended the process that was to {task} ({reason}); a model may use "
            f"{self._bounds.memory >> 20} MiB of memory"
        )

    def _decoded(self, answer: bytes, kind: type[Any]) -> Any:
        try:
            return msgspec.json.decode(answer, type=kind)
        except ValueError:
            raise self._died("answer") from None


def _end(process: "subprocess.Popen[bytes]", owner: int) -> None:
    """End a model's process, unless it is that of the process we were forked from."""
    if os.getpid() != owner:
        return
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            pipe.close()
