"""Proportional prioritization: transitions drawn in proportion to their last TD errors."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from touchdown.core.types import FloatArray, IntArray, Tensors
from touchdown.replay.sum_tree import SumTree

_SMALLEST = 1e-6  # added to |δ|, so that a transition with no error can still be drawn


@dataclass(frozen=True, slots=True)
class Proportional:
    """Settings of prioritized replay, proportional variant (Schaul et al., 2016)."""

    alpha: float
    """Exponent of the priorities."""
    beta: float
    """Initial exponent of the importance-sampling weights."""
    beta_duration: int
    """Batches over which that exponent rises linearly to 1."""


class Priorities:
    """pᵢ = (|δᵢ| + ε)^α, and batches drawn in proportion to pᵢ.

    Args:
        config: the exponents.
        capacity: of the replay memory.
    """

    def __init__(self, config: Proportional, capacity: int) -> None:
        self._config = config
        self._tree = SumTree(capacity)
        self._max_priority: float = 1.0  # given to transitions that were never drawn
        self._num_batches: float = 0

    def add(self, index: int) -> None:
        """A new transition is stored at this index: give it the highest priority so far."""
        self._tree.set_one(index, self._max_priority)

    def sample(
        self, batch_size: int, num_held: int, rng: Generator
    ) -> tuple[IntArray, NDArray[np.float32]]:
        """Draw a batch, one from each of B equal parts of the sum of priorities.

        Args:
            batch_size: B.
            num_held: transitions in the memory.
            rng: draws.

        Returns:
            Indices [B] and importance-sampling weights [B], the greatest of them 1.

        Raises:
            ValueError: the memory is empty.
        """
        if num_held == 0:
            raise ValueError("the memory is empty")
        total = self._tree.total
        # stratified: less variance than B independent draws
        sums = (np.arange(batch_size) + rng.random(batch_size)) * (total / batch_size)
        indices = self._tree.find(sums)
        config = self._config
        beta = min(1.0, config.beta + (1 - config.beta) * self._num_batches / config.beta_duration)
        self._num_batches += 1
        weights = (num_held * self._tree.values[indices] / total) ** -beta
        return indices, (weights / weights.max()).astype(np.float32)

    def update(self, indices: IntArray, td_error: FloatArray) -> None:
        """Set the priorities of some transitions by their TD errors: [B] each."""
        priorities = (np.abs(td_error) + _SMALLEST) ** self._config.alpha
        self._max_priority = max(self._max_priority, float(priorities.max()))
        self._tree.set(indices, priorities)

    def tensors(self, num_held: int) -> Tensors:
        """All state by name, for a checkpoint; priorities of the first `num_held` places."""
        return {
            "priority": self._tree.values[:num_held].copy(),
            "priority_state": np.array([self._max_priority, self._num_batches]),
        }

    def restore(self, tensors: Mapping[str, NDArray[Any]], num_held: int) -> None:
        """Set the state to what `tensors` returned for as many places.

        Raises:
            KeyError: something is missing.
            ValueError: something does not fit.
        """
        self._tree.set(np.arange(num_held), tensors["priority"])
        self._max_priority, self._num_batches = tensors["priority_state"].tolist()
