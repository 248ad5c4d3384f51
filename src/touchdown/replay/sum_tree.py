"""Sums over a row of numbers, kept so that one can be drawn in proportion to its size."""

import numpy as np
from numpy.typing import NDArray

from touchdown.core.types import FloatArray, IntArray


class SumTree:
    """A full binary tree whose leaves are the numbers and whose nodes are sums of two.

    Every node is added up anew from the two below it whenever one of them changes, so that rounding
    never gathers.

    Args:
        size: numbers, all 0 at first; at least 1.
    """

    def __init__(self, size: int) -> None:
        if size < 1:
            raise ValueError(f"size must be at least 1, got {size}")
        self._first_leaf = 1 << (size - 1).bit_length()
        self._size = size
        self._nodes: NDArray[np.float64] = np.zeros(2 * self._first_leaf)  # node i is over 2i, 2i+1

    @property
    def total(self) -> float:
        """The sum of all."""
        return float(self._nodes[1])

    @property
    def values(self) -> FloatArray:
        """The numbers, [size] (a view)."""
        return self._nodes[self._first_leaf : self._first_leaf + self._size]

    def set(self, indices: IntArray, values: FloatArray) -> None:
        """Change some numbers; of one index that comes more than once the last counts.

        Args:
            indices: [n], from 0.
            values: [n], 0 or more.
        """
        if not len(indices):
            return
        nodes = self._nodes
        places = indices + self._first_leaf
        nodes[places] = values
        while places[0] > 1:
            places = places >> 1
            nodes[places] = nodes[2 * places] + nodes[2 * places + 1]

    def set_one(self, index: int, value: float) -> None:
        """Change one number, without numpy's calls, which would cost twenty times as much."""
        nodes = self._nodes
        place = index + self._first_leaf
        nodes[place] = value
        while place > 1:
            place >>= 1
            nodes[place] = nodes[2 * place] + nodes[2 * place + 1]

    def find(self, sums: FloatArray) -> IntArray:
        """Of each sum, the index of the number in which the running sum passes it: [n] to [n].

        Args:
            sums: from 0, less than `total`.
        """
        nodes = self._nodes
        places = np.ones(len(sums), np.int64)
        left_over = np.array(sums, np.float64)
        while places[0] < self._first_leaf:
            places *= 2
            left = nodes[places]
            # where the right half is empty, rounding must not lead into it
            right = (left_over >= left) & (nodes[places + 1] > 0)
            left_over -= left * right
            places += right
        return places - self._first_leaf
