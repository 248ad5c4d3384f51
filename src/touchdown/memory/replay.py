"""Experience replay: a ring of transitions, sampled uniformly, with preferential re-saves."""

from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from touchdown.memory.ring import Ring
from touchdown.types import FloatArray, RecordArray, transition_dtype


class Shares(NamedTuple):
    """What the memory is made of, as shares of the transitions held."""

    rewarded: float
    terminal: float


class Replay:
    """The paper's memory: a FIFO queue (Algorithm 2) that stores rewards again (section 7).

    Args:
        capacity: transitions; every copy counts.
        observation_size: D, the length of an observation.
        resaves: τ, how often a rewarded transition is stored again (so τ + 1 copies in all).
        resave_threshold: a transition is rewarded when its reward is above this.
    """

    def __init__(
        self, capacity: int, observation_size: int, resaves: int = 0, resave_threshold: float = 0.0
    ) -> None:
        self._ring = Ring(capacity, transition_dtype(observation_size))
        self._resaves = resaves
        self._threshold = resave_threshold

    def __len__(self) -> int:
        return len(self._ring)

    @property
    def ring(self) -> Ring:
        """The storage, for checkpoints."""
        return self._ring

    def add(
        self,
        o_tm1: FloatArray,
        a_tm1: int,
        r_t: float,
        discount_t: float,
        o_t: FloatArray,
        *,
        terminated: bool,
    ) -> None:
        """Store one transition, τ + 1 times if it is rewarded."""
        record = (o_tm1, a_tm1, r_t, discount_t, terminated, o_t)
        for _ in range(1 + self._resaves if r_t > self._threshold else 1):
            self._ring.append(record)

    def sample(self, batch_size: int, rng: Generator) -> RecordArray:
        """Draw transitions uniformly, with replacement.

        Raises:
            ValueError: the memory is empty.
        """
        return self._ring.records.take(rng.integers(0, len(self), batch_size))  # faster than [...]

    def shares(self) -> Shares:
        """The rewarded and the terminal share of the transitions held (0 when empty)."""
        if not len(self):
            return Shares(0.0, 0.0)
        records = self._ring.records
        return Shares(
            float(np.mean(records["r_t"] > self._threshold)),
            float(np.mean(records["terminated"])),
        )
