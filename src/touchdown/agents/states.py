"""Discrete states: maps observations to rows of a table.

Shapes: N observations of D numbers, S states.
"""

from dataclasses import dataclass
from math import isfinite, prod
from typing import Protocol

import numpy as np

from touchdown.config.sections import TableConfig
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import FloatArray, IntArray, Spaces

_NO_BOUND = 1e30  # some environments use the largest float32 for "unbounded"


class States(Protocol):
    """Maps observations to the numbers of their states, one row of a table each."""

    @property
    def num_states(self) -> int:
        """S, the number of rows of the table."""
        ...

    def states(self, observations: FloatArray) -> IntArray:
        """The state of each observation, from 0 to S − 1: [N, D] to [N]."""
        ...


@dataclass(frozen=True, slots=True)
class OneHot:
    """States of a Discrete observation space, which Gymnasium flattens to one-hot vectors.

    Raises:
        ValueError: there are no states.
    """

    num_states: int

    def __post_init__(self) -> None:
        if self.num_states < 1:
            raise ValueError(f"need at least 1 state, got {self.num_states}")

    def states(self, observations: FloatArray) -> IntArray:
        """The index of the 1 in each observation: [N, S] to [N].

        Raises:
            ValueError: an observation is not one-hot, or does not have S numbers.
        """
        observations = _rows(observations, self.num_states)
        states = observations.argmax(axis=1)
        ones = observations[np.arange(len(states)), states] == 1
        if not (ones.all() and np.count_nonzero(observations) == len(states)):
            raise ValueError("observations must be one-hot: a single 1 among zeros")
        return states


@dataclass(frozen=True, slots=True)
class Grid:
    """States of a Box observation space: uniform bins from `low` to `high` in each dimension.

    The last dimension varies fastest. Values beyond the bounds belong to the first or last bin.

    Raises:
        ValueError: lengths differ, there are no bins, or a `low` is not below its `high`.
    """

    bins: tuple[int, ...]  # in each dimension
    low: tuple[float, ...]  # in the observation's units
    high: tuple[float, ...]  # in the observation's units

    def __post_init__(self) -> None:
        if not len(self.bins) == len(self.low) == len(self.high) > 0:
            raise ValueError(f"bins, low and high must have one length of at least 1, got {self}")
        if min(self.bins) < 1:
            raise ValueError(f"need at least 1 bin in each dimension, got {self.bins}")
        for low, high in zip(self.low, self.high, strict=True):
            if not (low < high and isfinite(high - low)):
                raise ValueError(f"need a finite low below a finite high, got {low} and {high}")

    @property
    def num_states(self) -> int:
        """S, the number of cells of the grid."""
        return prod(self.bins)

    def states(self, observations: FloatArray) -> IntArray:
        """The cell of each observation: [N, D] to [N].

        Raises:
            ValueError: an observation does not have D numbers, or contains NaN.
        """
        observations = _rows(observations, len(self.bins))
        if np.isnan(observations).any():
            raise ValueError("observations must be numbers, got NaN")
        low, high, bins = np.array(self.low), np.array(self.high), np.array(self.bins)
        # clipped before scaling, so that infinities count as the bounds and nothing overflows
        share = (np.clip(observations, low, high) - low) / (high - low)
        cells = np.minimum((share * bins).astype(np.intp), bins - 1)  # `high` is in the last bin
        return np.asarray(np.ravel_multi_index(tuple(cells.T), self.bins))


def _rows(observations: FloatArray, size: int) -> FloatArray:
    """The observations, checked to be [N, `size`]."""
    if observations.ndim != 2 or observations.shape[1] != size:
        raise ValueError(f"observations must be [N, {size}], got {list(observations.shape)}")
    return observations


def states_of(config: TableConfig, spaces: Spaces) -> States:
    """How an environment's observations map to states.

    Raises:
        UserError: `bins` do not fit the environment.
    """
    if spaces.num_states is not None:
        if config.bins:
            raise UserError(
                f"bins = {config.bins!r}: must be () for an environment of {spaces.num_states} "
                "discrete states"
            )
        return OneHot(spaces.num_states)
    size = spaces.observation_size
    if len(config.bins) != size:
        raise UserError(
            f"bins = {config.bins!r}: must be {size} numbers, the number of bins for each of the "
            f"observation's dimensions, such as --bins {' '.join(['4'] * size)}"
        )
    for name in ("low", "high"):
        bounds = getattr(config, f"bins_{name}") or getattr(spaces, name)
        if not all(abs(bound) < _NO_BOUND for bound in bounds):
            raise UserError(
                f"bins_{name} = (): must be {size} numbers, as the environment's own bounds are "
                f"not all finite: {', '.join(f'{bound:.4g}' for bound in bounds)}"
            )
    try:
        return Grid(config.bins, config.bins_low or spaces.low, config.bins_high or spaces.high)
    except ValueError as error:
        raise UserError(f"bins = {config.bins!r}: {one_line(error)}") from None
