"""A sum tree: changes numbers, and samples in proportion to their size, in logarithmic time."""

import numpy as np
from numpy.typing import NDArray

from touchdown.core.types import FloatArray, IntArray


class SumTree:
    """A full binary tree whose leaves are the numbers; every inner node is the sum of its children.

    When a number changes, every node above it is recomputed from its children, so rounding errors
    never accumulate.

    Args:
        size: number of numbers, at least 1; all are initially 0.

    Raises:
        ValueError: the size is less than 1.
    """

    def __init__(self, size: int) -> None:
        if size < 1:
            raise ValueError(f"size must be at least 1, got {size}")
        self._first_leaf = 1 << (size - 1).bit_length()
        self._size = size
        self.nodes: NDArray[np.float64] = np.zeros(2 * self._first_leaf)
        """All nodes: node i is the parent of 2i and 2i + 1, node 1 is the root."""

    @property
    def total(self) -> float:
        """The sum of all numbers."""
        return float(self.nodes[1])

    @property
    def values(self) -> FloatArray:
        """The numbers, [size] (a view)."""
        return self.nodes[self._first_leaf : self._first_leaf + self._size]

    def set(self, indices: IntArray, values: FloatArray) -> None:
        """Change some numbers; if an index is repeated, its last value counts.

        Args:
            indices: [n], from 0.
            values: [n], at least 0.
        """
        if not len(indices):
            return
        nodes = self.nodes
        places = indices + self._first_leaf
        nodes[places] = values
        while places[0] > 1:
            places = places >> 1
            nodes[places] = nodes[2 * places] + nodes[2 * places + 1]

    def set_one(self, index: int, value: float) -> None:
        """Change one number in plain Python: NumPy's calls would take twenty times as long."""
        nodes = self.nodes
        place = index + self._first_leaf
        nodes[place] = value
        while place > 1:
            place >>= 1
            nodes[place] = nodes[2 * place] + nodes[2 * place + 1]

    def find(self, sums: FloatArray) -> IntArray:
        """For each sum, the index at which the cumulative sum first exceeds it: [n] to [n].

        Args:
            sums: numbers from 0 to below `total`, [n].
        """
        nodes = self.nodes
        places = np.ones(len(sums), np.int64)
        remainder = np.array(sums, np.float64)
        while places[0] < self._first_leaf:
            places *= 2
            left = nodes[places]
            # rounding must not lead into a right half that is empty
            right = (remainder >= left) & (nodes[places + 1] > 0)
            remainder -= left * right
            places += right
        return places - self._first_leaf
