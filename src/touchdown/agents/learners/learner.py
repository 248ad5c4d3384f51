"""The protocol of a learner, as agents use it."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.learners.state import LearnerState, Metrics
from touchdown.agents.model import Model
from touchdown.agents.rollout import Rollout
from touchdown.core.types import FloatArray, Tensors


class UpdateResult(NamedTuple):
    """Results of updates besides the new parameters; JAX may still be computing the arrays."""

    metrics: Metrics | None
    """Of the last update; None if they were not requested."""
    td_error: Any
    """TD errors before each update, [K, B]."""
    next_q: Any
    """Q(s,·) of the next observations with the new parameters, [N, A]."""


class FitResult(NamedTuple):
    """Like `UpdateResult`, for a fit to a rollout."""

    metrics: Metrics
    next_q: Any


class Learner(Protocol):
    """A network, its target network and optimiser state, and their updates.

    Updates also compute the values that the next actions need: for a small network, the overhead of
    a second call would equal its arithmetic.
    """

    @property
    def model(self) -> Model:
        """The network that the parameters belong to."""
        ...

    @property
    def state(self) -> LearnerState:
        """Everything that an update reads and writes."""
        ...

    def values(self, observations: FloatArray, env_steps: int) -> FloatArray:
        """Q(s,·) for choosing actions: [N, D] to [N, A].

        Args:
            observations: [N, D].
            env_steps: environment steps so far; noisy weights are redrawn whenever it changes.
        """
        ...

    def update(
        self,
        packed: NDArray[np.float32],
        weights: NDArray[np.float32] | None,
        next_observations: FloatArray,
        updates: int,
        *,
        measured: bool,
    ) -> UpdateResult:
        """Update the parameters with K minibatches, one after the other.

        Args:
            packed: transitions as 4-byte entries, [K, B, W].
            weights: importance-sampling weights, [K, B], or None.
            next_observations: observations that the next actions are chosen for, [N, D].
            updates: updates done so far; noisy weights are redrawn for each one.
            measured: whether to return metrics of the last update.
        """
        ...

    def fit_rollout(
        self, rollout: Rollout, order: NDArray[np.int64], next_observations: FloatArray
    ) -> FitResult:
        """Fit Q(s,a) to the λ-returns of a rollout with K minibatches, one after the other.

        Args:
            rollout: T steps of N environments, in NumPy arrays.
            order: indices of its T·N steps in each minibatch, [K, B].
            next_observations: observations that the next actions are chosen for, [N, D].
        """
        ...

    def copy_target(self) -> None:
        """Θ′ ← Θ (Eq. 5)."""
        ...

    def tensors(self) -> Tensors:
        """All arrays of the state by name, for a checkpoint."""
        ...

    def restore(self, tensors: Mapping[str, NDArray[Any]]) -> None:
        """Restore the state that `tensors` returned.

        Raises:
            ValueError: the names, shapes or types are not those of this learner.
        """
        ...
