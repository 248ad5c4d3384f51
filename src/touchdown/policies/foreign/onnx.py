"""An ONNX model, ours or another, as a policy, computed by onnxruntime in another process."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.greedy import in_blocks
from touchdown.core import installation, limits
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray, IntArray, Spaces
from touchdown.envs import environment
from touchdown.policies.foreign.onnx_session import missing_package
from touchdown.policies.foreign.worker_model import Input, Result, WorkerModel

_ROWS = 32  # observations per call, if the model leaves N open


class Model(Protocol):
    """A loaded model; `WorkerModel` is one."""

    @property
    def inputs(self) -> Sequence[Input]:
        """The inputs of the model."""
        ...

    def results(self, observations: NDArray[np.float32]) -> list[Result]:
        """What each output is, for observations [B, D]."""
        ...

    def run(self, observations: NDArray[np.float32], output: str) -> NDArray[Any]:
        """The array of one output, for observations [B, D]."""
        ...


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

    def __init__(self, model: Model, spaces: Spaces, where: str) -> None:
        self._model, self._where = model, where
        self._num_actions = spaces.num_actions
        shapes = [f"{each.type} {each.shape}" for each in model.inputs]
        match list(model.inputs):
            case [Input("tensor(float)", [rows, size])]:
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
        if not 1 <= self._rows <= limits.ONNX_ROWS:
            raise UserError(
                f"{where}: takes {rows} observations, must be from 1 to {limits.ONNX_ROWS}"
            )
        self._output, self._gives_values = self._choose(spaces)

    def _choose(self, spaces: Spaces) -> tuple[Result, bool]:
        """The output to use, and whether it contains values; shapes are found by a trial call."""
        zeros = np.zeros((self._rows, spaces.observation_size), np.float32)
        results = self._model.results(zeros)
        for result in results:
            is_float = np.dtype(result.dtype).kind == "f"
            if is_float and result.shape == [self._rows, spaces.num_actions]:
                return result, True
        for result in results:
            is_whole = np.dtype(result.dtype).kind == "i"
            if is_whole and result.shape in ([self._rows], [self._rows, 1]):
                return result, False
        shapes = [f"{each.name} {np.dtype(each.dtype)}{each.shape}" for each in results]
        raise UserError(
            f"{self._where}: returns {', '.join(shapes) or 'no array'} for {self._rows} "
            f"observations, must be values [N, {spaces.num_actions}] or actions [N]; --env-id sets "
            "the environment"
        )

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, D] to [N].

        Raises:
            UserError: the model returns an action that the environment does not have, or a value
                that is not finite, or it exceeds a limit.
        """
        given = in_blocks(self._given, observations, self._rows)
        if self._gives_values:
            finite = np.isfinite(given)
            if not finite.all():
                wrong = given[~finite][0]
                raise UserError(f"{self._where}: value {wrong} of an action: must be finite")
            return given.argmax(axis=1)
        actions = given.reshape(len(observations))
        wrong = actions[(actions < 0) | (actions >= self._num_actions)]
        if len(wrong):
            raise UserError(
                f"{self._where}: action {wrong[0]}: must be from 0 to {self._num_actions - 1}"
            )
        return actions

    def _given(self, block: NDArray[np.float32]) -> NDArray[Any]:
        expected = self._output
        given = self._model.run(block, expected.name)
        if (given.dtype.str, list(given.shape)) != (expected.dtype, expected.shape):
            raise UserError(
                f"{self._where}: returns {expected.name} {given.dtype}{list(given.shape)}, and for "
                f"other observations {np.dtype(expected.dtype)}{expected.shape}"
            )
        return given


def read_onnx(path: Path, env_id: str) -> tuple[OnnxPolicy, str]:
    """A policy from an ONNX file, and the id of the environment that it is for.

    Args:
        path: path of the `.onnx` file.
        env_id: the environment if the file does not name one; our files do.

    Raises:
        UserError: onnxruntime is not installed, the file is broken or exceeds a limit, or it does
            not fit the environment.
    """
    missing = missing_package()
    if missing is not None:
        raise installation.missing(str(path), missing, "onnx")
    model = WorkerModel(path)
    named = model.env_id or env_id
    return OnnxPolicy(model, environment.spaces_of(named), str(path)), named
