"""An ONNX model, ours or another, as a policy, computed by onnxruntime."""

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.greedy import in_blocks
from touchdown.core import files, onnx_runtime
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import FloatArray, IntArray, Spaces
from touchdown.envs import environment

_MOST_BYTES = 512 << 20
_MOST_ROWS = 1_024
_ROWS = 32  # observations per call, if the model leaves N open


class OnnxModel:
    """A loaded model, computed on one thread.

    Args:
        source: the bytes of the model, or its path, so that weights in a separate file are found.
        where: the origin of the model, for error messages.

    Raises:
        UserError: onnxruntime is not installed, or the model is broken.
    """

    def __init__(self, source: bytes | Path, where: str) -> None:
        onnxruntime = onnx_runtime.load(where)
        errors: Any = import_module("onnxruntime.capi.onnxruntime_pybind11_state")
        options: Any = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4  # errors are raised, so no log is needed
        self._where = where
        self._errors: tuple[type[Exception], ...] = (
            errors.Fail,
            errors.InvalidArgument,
            errors.InvalidGraph,
            errors.InvalidProtobuf,
            errors.NotImplemented,
            errors.RuntimeException,
            RuntimeError,
            ValueError,
        )
        try:
            self._session: Any = onnxruntime.InferenceSession(
                source if isinstance(source, bytes) else str(source),
                options,
                providers=["CPUExecutionProvider"],
            )
        except self._errors as error:
            raise UserError(f"{where}: not a complete ONNX model: {one_line(error)}") from None

    @property
    def inputs(self) -> list[tuple[str, str, list[int | str | None]]]:
        """Name, type and shape of each input; an open dimension is not an integer."""
        return [(each.name, each.type, each.shape) for each in self._session.get_inputs()]

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata of the model."""
        return dict(self._session.get_modelmeta().custom_metadata_map)

    def run(self, observations: FloatArray, outputs: Sequence[str] | None = None) -> list[Any]:
        """Compute the named outputs, or all of them.

        Raises:
            UserError: the model cannot compute them.
        """
        name = self.inputs[0][0]
        try:
            return cast(list[Any], self._session.run(outputs, {name: observations}))
        except self._errors as error:
            raise UserError(f"{self._where}: cannot be computed: {one_line(error)}") from None

    @property
    def outputs(self) -> list[str]:
        """The names of the outputs."""
        return [each.name for each in self._session.get_outputs()]


class OnnxPolicy:
    """Chooses the action with the largest value of a model, or the action that the model returns.

    Args:
        model: a model with one input, float32 [N, D], or [B, D] with a fixed B such as 1. The first
            float output [N, A] is used as values; otherwise the first integer output, [N] or
            [N, 1], as actions.
        spaces: spaces of the environment.
        where: the origin of the model, for error messages.

    Raises:
        UserError: the model has different inputs or outputs.
    """

    def __init__(self, model: OnnxModel, spaces: Spaces, where: str) -> None:
        self._model, self._where = model, where
        self._num_actions = spaces.num_actions
        shapes = [f"{kind} {shape}" for _, kind, shape in model.inputs]
        match [(kind, shape) for _, kind, shape in model.inputs]:
            case [("tensor(float)", [rows, size])]:
                pass
            case _:
                raise UserError(
                    f"{where}: its inputs are {', '.join(shapes) or 'none'}; "
                    f"must be one tensor(float) [N, {spaces.observation_size}]"
                )
        if isinstance(size, int) and size != spaces.observation_size:
            raise UserError(
                f"{where}: takes observations of {size} numbers, but the environment has "
                f"{spaces.observation_size}; set another one with --env-id"
            )
        self._rows = rows if isinstance(rows, int) else _ROWS
        if not 1 <= self._rows <= _MOST_ROWS:
            raise UserError(f"{where}: takes {rows} observations, must be from 1 to {_MOST_ROWS}")
        self._output, self._gives_values = self._choose(spaces)

    def _choose(self, spaces: Spaces) -> tuple[str, bool]:
        """The output to use, and whether it contains values; shapes are found by a trial call."""
        zeros = np.zeros((self._rows, spaces.observation_size), np.float32)
        results = [
            (name, cast(NDArray[Any], result))
            for name, result in zip(self._model.outputs, self._model.run(zeros), strict=True)
            if isinstance(result, np.ndarray)
        ]
        for name, result in results:
            if result.dtype.kind == "f" and result.shape == (self._rows, spaces.num_actions):
                return name, True
        for name, result in results:
            if result.dtype.kind == "i" and result.shape in ((self._rows,), (self._rows, 1)):
                return name, False
        shapes = [f"{name} {result.dtype}{list(result.shape)}" for name, result in results]
        raise UserError(
            f"{self._where}: returns {', '.join(shapes)} for {self._rows} observations, must be "
            f"values [N, {spaces.num_actions}] or actions [N]; --env-id sets the environment"
        )

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, D] to [N].

        Raises:
            UserError: the model returns an action that the environment does not have.
        """
        given = in_blocks(self._given, observations, self._rows)
        if self._gives_values:
            return given.argmax(axis=1)
        actions = given.reshape(len(observations))
        wrong = actions[(actions < 0) | (actions >= self._num_actions)]
        if len(wrong):
            raise UserError(
                f"{self._where}: action {wrong[0]}: must be from 0 to {self._num_actions - 1}"
            )
        return actions

    def _given(self, block: NDArray[np.float32]) -> NDArray[Any]:
        return self._model.run(block, [self._output])[0]


def read_onnx(path: Path, env_id: str) -> tuple[OnnxPolicy, str]:
    """A policy from an ONNX file, and the id of the environment that it is for.

    Args:
        path: path of the `.onnx` file.
        env_id: the environment if the file does not name one; our files do.

    Raises:
        UserError: onnxruntime is not installed, or the file is broken or does not fit the
            environment.
    """
    files.read_bytes(path, _MOST_BYTES)  # check that it exists and is not too large
    model = OnnxModel(path, str(path))
    named = model.metadata.get("env_id", env_id)
    spaces = environment.spaces_of(named)
    return OnnxPolicy(model, spaces, str(path)), named
