"""A table of action values, and its greedy policy."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.states import States
from touchdown.config.sections import TableConfig
from touchdown.core.types import FloatArray, IntArray


class QTable:
    """A table of action values; its flat parameters are its rows in order, [S·A].

    Args:
        states: maps an observation to the number of its state.
        num_actions: A.
        config: config of the states.
    """

    def __init__(self, states: States, num_actions: int, config: TableConfig) -> None:
        self.states = states
        self.shape = states.num_states, num_actions
        self._config = config

    def layers(self, params: FloatArray) -> dict[str, FloatArray]:
        """The table under the name `q`, [S, A]."""
        return {"q": params.reshape(self.shape)}

    def params_of(self, layers: Mapping[str, NDArray[Any]]) -> FloatArray:
        """Flat parameters from a named table; the inverse of `layers`.

        Raises:
            ValueError: it is not a table, or has the wrong shape or type.
        """
        if list(layers) != ["q"]:
            raise ValueError(f"it has {sorted(layers)}, must be q, the table")
        q = layers["q"]
        if q.shape != self.shape or q.dtype != np.float64:
            raise ValueError(f"q is {q.dtype}{q.shape}, must be float64{self.shape}")
        return q.ravel()

    def policy(self, params: FloatArray) -> "TablePolicy":
        """The greedy policy of this table [S·A]."""
        return TablePolicy(self.states, params.reshape(self.shape), self._config)

    def describe(self) -> dict[str, Any]:
        """The table's config, under its key in a file of weights."""
        return _description(self._config)


class TablePolicy:
    """Chooses the action with the highest value in each state, the first one in a tie.

    Args:
        states: maps an observation to the number of its state.
        q: the table, [S, A].
        config: of the states.
    """

    def __init__(self, states: States, q: FloatArray, config: TableConfig) -> None:
        self._states = states
        self.q = q
        self._config = config

    def act(self, observations: FloatArray) -> IntArray:
        """The best action of each observation: [N, D] to [N]."""
        return self.values(observations).argmax(axis=1)

    def values(self, observations: FloatArray) -> FloatArray:
        """Q(s,·) of each observation: [N, D] to [N, A]."""
        return self.q[self._states.states(observations)]

    def describe(self) -> dict[str, Any]:
        """The table's config, under its key in a file of weights."""
        return _description(self._config)


def _description(config: TableConfig) -> dict[str, Any]:
    bins = {"bins": config.bins, "bins_low": config.bins_low, "bins_high": config.bins_high}
    return {"table": bins}
