"""The replay memory, which re-saves rewarded transitions and samples batches."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from touchdown.core.types import FloatArray, IntArray, Mirror, RecordArray, Tensors
from touchdown.replay.mirrored import Mirrored
from touchdown.replay.priorities import Priorities, Proportional
from touchdown.replay.ring import Ring
from touchdown.replay.transition import Transition, transition_dtype


class Shares(NamedTuple):
    """Fractions of the stored transitions, from 0 to 1."""

    rewarded: float
    terminal: float


class Sample(NamedTuple):
    """A batch of transitions sampled from the memory."""

    records: RecordArray
    """[B], records of `transition_dtype`."""
    indices: IntArray
    """[B], their indices in the memory."""
    weights: NDArray[np.float32] | None
    """[B], importance-sampling weights; None for uniform sampling."""


class Replay:
    """The paper's replay memory: a FIFO queue (Algorithm 2) with preferential re-saves (section 7).

    Args:
        capacity: number of transitions, including copies.
        observation_size: D, the length of an observation.
        resaves: τ, extra copies stored of a rewarded transition (τ + 1 copies in total).
        resave_threshold: a transition counts as rewarded if its reward exceeds this.
        priorities: prioritisation by TD error; None samples uniformly.
        mirror: the symmetry by which each transition's mirror image is stored too; None stores no
            images.
    """

    def __init__(
        self,
        capacity: int,
        observation_size: int,
        resaves: int = 0,
        resave_threshold: float = 0.0,
        priorities: Proportional | None = None,
        mirror: Mirror | None = None,
    ) -> None:
        self._ring = Ring(capacity, transition_dtype(observation_size))
        self._priorities = priorities and Priorities(priorities, capacity)
        self._resaves = resaves
        self._threshold = resave_threshold
        self._mirrored = mirror and Mirrored(mirror)

    def __len__(self) -> int:
        return len(self._ring)

    @property
    def ring(self) -> Ring:
        """The storage, for checkpoints."""
        return self._ring

    @property
    def priorities(self) -> Priorities | None:
        """The priorities; None in a uniform memory."""
        return self._priorities

    def add(self, transition: Transition) -> None:
        """Store one transition, τ + 1 times if it is rewarded, and its mirror image as often."""
        self._store(transition)
        if self._mirrored is not None:
            self._store(self._mirrored(transition))

    def _store(self, transition: Transition) -> None:
        for _ in range(1 + self._resaves if transition.r_t > self._threshold else 1):
            if self._priorities is not None:
                self._priorities.add(self._ring.added % self._ring.capacity)
            self._ring.append(transition)

    def sample(self, batch_size: int, rng: Generator) -> Sample:
        """Sample transitions with replacement, uniformly or in proportion to their priorities.

        Raises:
            ValueError: the memory is empty.
        """
        if self._priorities is None:
            indices = rng.integers(0, len(self), batch_size)
            weights = None
        else:
            indices, weights = self._priorities.sample(batch_size, len(self), rng)
        return Sample(self._ring.records.take(indices), indices, weights)  # faster than [...]

    def update_priorities(self, indices: IntArray, td_error: FloatArray) -> None:
        """Update the priorities of a sample with its new TD errors; no effect in a uniform memory.

        Args:
            indices: indices of the sample, [B].
            td_error: TD errors, [B].
        """
        if self._priorities is not None:
            self._priorities.update(indices, td_error)

    def tensors(self) -> Tensors:
        """All contents by name, for a checkpoint."""
        records = self._ring.records
        tensors = {name: np.ascontiguousarray(records[name]) for name in records.dtype.names or ()}
        if self._priorities is not None:
            tensors |= self._priorities.tensors(len(self))
        return tensors

    def restore(self, tensors: Mapping[str, NDArray[Any]], added: int) -> None:
        """Restore the contents that `tensors` returned.

        Args:
            tensors: tensors of a memory with the same settings.
            added: number of transitions ever added to it, including overwritten ones.

        Raises:
            KeyError: something is missing.
            ValueError: something does not fit.
        """
        records = np.zeros(len(tensors["a_tm1"]), self._ring.records.dtype)
        for name in records.dtype.names or ():
            records[name] = tensors[name]
        self._ring.restore(records, added)
        if self._priorities is not None:
            self._priorities.restore(tensors, len(records))

    def shares(self) -> Shares:
        """The rewarded and the terminal fraction of the stored transitions (0 if empty)."""
        if not len(self):
            return Shares(0.0, 0.0)
        records = self._ring.records
        return Shares(
            float(np.mean(records["r_t"] > self._threshold)),
            float(np.mean(records["terminated"])),
        )
