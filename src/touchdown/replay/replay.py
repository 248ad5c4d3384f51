"""Experience replay: a ring of transitions with re-saves, and how some are drawn from it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from touchdown.core.types import FloatArray, IntArray, RecordArray
from touchdown.replay.ring import Ring
from touchdown.replay.sum_tree import SumTree
from touchdown.replay.transition import Transition, transition_dtype

_LEAST_PRIORITY = 1e-6  # so that what is known well still has a chance


class Shares(NamedTuple):
    """What the memory is made of, as shares of the transitions held."""

    rewarded: float
    terminal: float


class Sample(NamedTuple):
    """Transitions drawn from the memory."""

    records: RecordArray
    indices: IntArray
    """[B]: their places."""
    weights: NDArray[np.float32] | None
    """[B]: what makes up for drawing some more often; None where all have the same chance."""


@dataclass(frozen=True, slots=True)
class Proportional:
    """Prioritized replay, proportional variant (Schaul et al., 2016)."""

    alpha: float
    """Exponent of the priorities."""
    beta: float
    """Exponent of the importance weights at the start."""
    beta_duration: int
    """Samples over which that exponent rises to 1 in a line."""


class _Priorities:
    """pᵢ = (|δᵢ| + ε)^α, and a draw in proportion to them."""

    def __init__(self, config: Proportional, capacity: int) -> None:
        self._config = config
        self.tree = SumTree(capacity)
        self.most: float = 1.0  # priority of what was not yet drawn
        self.drawn: float = 0  # samples so far

    def begin(self, index: int) -> None:
        self.tree.set_one(index, self.most)

    def draw(
        self, batch_size: int, held: int, rng: Generator
    ) -> tuple[IntArray, NDArray[np.float32]]:
        if held == 0:
            raise ValueError("the memory is empty")
        total = self.tree.total
        # one from each of B equal parts of the sum: less varied than B independent draws
        sums = (np.arange(batch_size) + rng.random(batch_size)) * (total / batch_size)
        indices = self.tree.find(sums)
        config = self._config
        beta = min(1.0, config.beta + (1 - config.beta) * self.drawn / config.beta_duration)
        self.drawn += 1
        weights = (held * self.tree.values[indices] / total) ** -beta
        return indices, (weights / weights.max()).astype(np.float32)

    def set(self, indices: IntArray, td_error: FloatArray) -> None:
        priorities = (np.abs(td_error) + _LEAST_PRIORITY) ** self._config.alpha
        self.most = max(self.most, float(priorities.max()))
        self.tree.set(indices, priorities)


class Replay:
    """The paper's memory: a FIFO queue (Algorithm 2) that stores rewards again (section 7).

    Args:
        capacity: transitions; every copy counts.
        observation_size: D, the length of an observation.
        resaves: τ, how often a rewarded transition is stored again (so τ + 1 copies in all).
        resave_threshold: a transition is rewarded when its reward is above this.
        priorities: how transitions are preferred by their TD error; None draws uniformly.
    """

    def __init__(
        self,
        capacity: int,
        observation_size: int,
        resaves: int = 0,
        resave_threshold: float = 0.0,
        priorities: Proportional | None = None,
    ) -> None:
        self._ring = Ring(capacity, transition_dtype(observation_size))
        self._priorities = priorities and _Priorities(priorities, capacity)
        self._resaves = resaves
        self._threshold = resave_threshold

    def __len__(self) -> int:
        return len(self._ring)

    @property
    def ring(self) -> Ring:
        """The storage, for checkpoints."""
        return self._ring

    def add(self, transition: Transition) -> None:
        """Store one transition, τ + 1 times if it is rewarded."""
        o_tm1, a_tm1, r_t, discount_t, o_t, terminated, a_t = transition
        record = (o_tm1, a_tm1, r_t, discount_t, terminated, a_t, o_t)
        for _ in range(1 + self._resaves if r_t > self._threshold else 1):
            if self._priorities is not None:
                self._priorities.begin(self._ring.added % self._ring.capacity)
            self._ring.append(record)

    def sample(self, batch_size: int, rng: Generator) -> Sample:
        """Draw transitions with replacement: uniformly, or in proportion to their priorities.

        Raises:
            ValueError: the memory is empty.
        """
        if self._priorities is None:
            indices = rng.integers(0, len(self), batch_size)
            weights = None
        else:
            indices, weights = self._priorities.draw(batch_size, len(self), rng)
        return Sample(self._ring.records.take(indices), indices, weights)  # faster than [...]

    def learnt(self, indices: IntArray, td_error: FloatArray) -> None:
        """Hear how surprising drawn transitions were; a uniform memory takes no notice.

        Args:
            indices: [B], a sample's.
            td_error: [B].
        """
        if self._priorities is not None:
            self._priorities.set(indices, td_error)

    def tensors(self) -> dict[str, NDArray[Any]]:
        """All that it holds, by name, for a checkpoint."""
        records = self._ring.records
        tensors = {name: np.ascontiguousarray(records[name]) for name in records.dtype.names or ()}
        if self._priorities is not None:
            tensors["priority"] = self._priorities.tree.values[: len(self)].copy()
            tensors["priority_state"] = np.array([self._priorities.most, self._priorities.drawn])
        return tensors

    def restore(self, tensors: Mapping[str, NDArray[Any]], added: int) -> None:
        """Take over what `tensors` gave, of a memory to which `added` transitions were added.

        Raises:
            KeyError: something is missing.
            ValueError: something does not fit.
        """
        records = np.zeros(len(tensors["a_tm1"]), self._ring.records.dtype)
        for name in records.dtype.names or ():
            records[name] = tensors[name]
        self._ring.restore(records, added)
        if self._priorities is not None:
            self._priorities.tree.set(np.arange(len(records)), tensors["priority"])
            self._priorities.most, self._priorities.drawn = tensors["priority_state"].tolist()

    def shares(self) -> Shares:
        """The rewarded and the terminal share of the transitions held (0 when empty)."""
        if not len(self):
            return Shares(0.0, 0.0)
        records = self._ring.records
        return Shares(
            float(np.mean(records["r_t"] > self._threshold)),
            float(np.mean(records["terminated"])),
        )
