"""Proportional prioritisation: samples transitions in proportion to their last TD errors."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from touchdown.core.types import FloatArray, IntArray, Tensors
from touchdown.replay.sum_tree import SumTree

_SMALLEST = 1e-6  # added to |δ|, so that transitions without error can still be sampled


@dataclass(frozen=True, slots=True)
class Proportional:
    """Settings of prioritised replay, proportional variant (Schaul et al., 2016)."""

    alpha: float
    """Priority exponent."""
    beta: float
    """Initial exponent of the importance-sampling weights."""
    beta_duration: int
    """Number of batches over which beta increases linearly to 1."""


class Priorities:
    """Priorities pᵢ = (|δᵢ| + ε)^α, and batches sampled in proportion to them.

    Args:
        config: the exponents.
        capacity: capacity of the replay memory.
    """

    def __init__(self, config: Proportional, capacity: int) -> None:
        self._config = config
        self._tree = SumTree(capacity)
        self.max_priority: float = 1.0
        """Of the transitions that were never sampled."""
        self.num_batches: float = 0
        """Batches that were sampled."""

    @property
    def nodes(self) -> NDArray[np.float64]:
        """The nodes of the sum tree, for the compiled loop; see `SumTree.nodes`."""
        return self._tree.nodes

    def add(self, index: int) -> None:
        """Give the new transition at this index the highest priority so far."""
        self._tree.set_one(index, self.max_priority)

    def sample(
        self, batch_size: int, num_held: int, rng: Generator
    ) -> tuple[IntArray, NDArray[np.float32]]:
        """Sample a batch, one transition from each of B equal parts of the total priority.

        Args:
            batch_size: B.
            num_held: transitions in the memory.
            rng: random generator.

        Returns:
            Indices [B] and importance-sampling weights [B], normalised to a maximum of 1.

        Raises:
            ValueError: the memory is empty.
        """
        if num_held == 0:
            raise ValueError("the memory is empty")
        total = self._tree.total
        # stratified, with less variance than B independent draws
        sums = (np.arange(batch_size) + rng.random(batch_size)) * (total / batch_size)
        indices = self._tree.find(sums)
        config = self._config
        beta = min(1.0, config.beta + (1 - config.beta) * self.num_batches / config.beta_duration)
        self.num_batches += 1
        weights = _powers(num_held * self._tree.values[indices] / total, -beta)
        return indices, (weights / weights.max()).astype(np.float32)

    def update(self, indices: IntArray, td_error: FloatArray) -> None:
        """Update the priorities of some transitions with their TD errors, [B] each."""
        errors = np.abs(td_error.astype(np.float64))
        priorities = _powers(errors + _SMALLEST, self._config.alpha)
        self.max_priority = max(self.max_priority, float(priorities.max()))
        self._tree.set(indices, priorities)

    def tensors(self, num_held: int) -> Tensors:
        """All state by name, for a checkpoint; priorities of the first `num_held` transitions."""
        return {
            "priority": self._tree.values[:num_held].copy(),
            "priority_state": np.array([self.max_priority, self.num_batches]),
        }

    def restore(self, tensors: Mapping[str, NDArray[Any]], num_held: int) -> None:
        """Restore the state that `tensors` returned for the same number of transitions.

        Raises:
            KeyError: something is missing.
            ValueError: something does not fit.
        """
        self._tree.set(np.arange(num_held), tensors["priority"])
        self.max_priority, self.num_batches = tensors["priority_state"].tolist()


def _powers(bases: FloatArray, exponent: float) -> NDArray[np.float64]:
    """Each base to the power of the exponent, by the C library as in the compiled loop.

    NumPy's own power rounds differently with some instruction sets.
    """
    return np.array([math.pow(base, exponent) for base in bases.tolist()])
