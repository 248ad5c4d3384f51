"""An ONNX model in onnxruntime, on one thread.

It imports nothing of ours, so that the process that runs a stranger's model starts fast.
"""

import os
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any, NamedTuple, cast

from numpy.typing import NDArray

PACKAGES = ("onnx", "onnxruntime")


def missing_package() -> str | None:
    """The name of a package that a model needs and that is not installed."""
    return next((name for name in PACKAGES if find_spec(name) is None), None)


class Port(NamedTuple):
    """An input of a model, or an output."""

    name: str
    type: str
    """As onnxruntime writes it, such as `tensor(float)`."""
    shape: list[int | str | None]
    """An open dimension is not an integer."""


class Session:
    """A loaded model.

    Args:
        source: the bytes of the model, or its path, so that weights in other files are found.

    Raises:
        ValueError: the model is broken.
    """

    def __init__(self, source: bytes | str) -> None:
        # its official builds send events to their maker, unless this says so before the import
        os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
        onnxruntime: Any = import_module("onnxruntime")
        errors: Any = import_module("onnxruntime.capi.onnxruntime_pybind11_state")
        options: Any = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4  # errors are raised, so no log is needed
        self._errors: tuple[type[Exception], ...] = (
            errors.Fail,
            errors.InvalidArgument,
            errors.InvalidGraph,
            errors.InvalidProtobuf,
            errors.NotImplemented,
            errors.RuntimeException,
            MemoryError,
            RuntimeError,
            ValueError,
        )
        try:
            self._session: Any = onnxruntime.InferenceSession(
                source, options, providers=["CPUExecutionProvider"]
            )
        except self._errors as error:
            raise ValueError(f"not a complete ONNX model: {_one_line(error)}") from None
        self.inputs = [_port(each) for each in self._session.get_inputs()]
        self.outputs = [_port(each) for each in self._session.get_outputs()]

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata of the model."""
        return dict(self._session.get_modelmeta().custom_metadata_map)

    def run(self, observations: NDArray[Any], outputs: Sequence[str] | None = None) -> list[Any]:
        """Compute the named outputs, or all of them, for the only input.

        Raises:
            ValueError: the model cannot compute them.
        """
        try:
            given = {self.inputs[0].name: observations}
            return cast(list[Any], self._session.run(outputs, given))
        except self._errors as error:
            raise ValueError(f"cannot be computed: {_one_line(error)}") from None


def _port(given: Any) -> Port:
    return Port(given.name, given.type, given.shape)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
