"""The greedy policy of a network; its actions do not depend on the batch size."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray, IntArray

_ROWS = 32  # observations in each call of a compiled function


class ValueFunction(Protocol):
    """Q(s,·) as a function of parameters, for each observation independently of the batch."""

    def values_of_each(self, params: Any, observations: FloatArray) -> FloatArray:
        """Q(s,·) of any number of observations with parameters [P]: [N, D] to [N, A]."""
        ...

    def layers(self, params: Any) -> Mapping[str, FloatArray]:
        """The parameters by name, each in its own shape."""
        ...

    def describe(self) -> dict[str, Any]:
        """What it takes to make the network again, as JSON values."""
        ...


class GreedyPolicy:
    """Chooses the action with the highest value in each state.

    Args:
        network: computes the values.
        params: its flat parameters, [P], in an array of the kind that the network computes with.
    """

    def __init__(self, network: ValueFunction, params: Any) -> None:
        self.params = params
        self.network = network

    def act(self, observations: FloatArray) -> IntArray:
        """The best action for each observation: [N, D] to [N]."""
        return self.values(observations).argmax(axis=1)

    def values(self, observations: FloatArray) -> FloatArray:
        """Q(s,·) of each observation: [N, D] to [N, A].

        Raises:
            UserError: a value is not finite, so there is no best action.
        """
        values = self.network.values_of_each(self.params, observations)
        finite = np.isfinite(values)
        if not finite.all():
            wrong = observations[~finite.all(axis=1)][0][:8]
            raise UserError(
                f"the policy's values are not finite for the observation {wrong.tolist()}"
            )
        return values

    def describe(self) -> dict[str, Any]:
        """What it takes to make the network again, under its key in a file of weights."""
        return self.network.describe()


def in_blocks(
    function: Callable[[NDArray[np.float32]], NDArray[Any]],
    observations: FloatArray,
    rows: int = _ROWS,
) -> NDArray[Any]:
    """Apply a function of observations to blocks of a fixed size.

    It is then compiled only once, and the result for an observation does not depend on how many
    there are (another shape may round differently).

    Args:
        function: [rows, D] to [rows, ...].
        observations: [N, D], 1 or more.
        rows: observations per block; the last block is padded with zeros.

    Returns:
        [N, ...].
    """
    results: list[NDArray[Any]] = []
    for first in range(0, len(observations), rows):
        some = observations[first : first + rows]
        padded = np.zeros((rows, some.shape[1]), np.float32)
        padded[: len(some)] = some
        results.append(function(padded)[: len(some)])
    return np.concatenate(results)
