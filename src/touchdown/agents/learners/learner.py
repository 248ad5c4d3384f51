"""The contract between an agent and a learner."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.learners.state import LearnerState, Metrics
from touchdown.agents.model import Model
from touchdown.agents.rollout import Rollout
from touchdown.core.types import FloatArray, Tensors


class UpdateResult(NamedTuple):
    """What updates give besides the new parameters; JAX may still be computing the arrays."""

    metrics: Metrics | None
    """Of the last update; None where they were not asked for."""
    td_error: Any
    """TD errors before each update, [K, B]."""
    next_q: Any
    """Q(s,·) of the next observations by the new parameters, [N, A]."""


class FitResult(NamedTuple):
    """As `UpdateResult`, of a fit to a rollout."""

    metrics: Metrics
    next_q: Any


class Learner(Protocol):
    """A network, its target network and its optimizer's state, and the updates of these.

    Updates also compute the values that the next actions need: for a small network a second call
    would cost as much as its arithmetic.
    """

    @property
    def model(self) -> Model:
        """The network: what the parameters belong to."""
        ...

    @property
    def state(self) -> LearnerState:
        """Everything that an update reads and writes."""
        ...

    def values(self, observations: FloatArray, env_steps: int) -> FloatArray:
        """Q(s,·) for choosing actions: [N, D] to [N, A].

        Args:
            observations: [N, D].
            env_steps: so far; noisy weights are drawn anew whenever it changes.
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
        """Update the parameters by K minibatches, one after the other.

        Args:
            packed: transitions as 4-byte entries, [K, B, W].
            weights: importance-sampling weights, [K, B], or None.
            next_observations: that actions are chosen for next, [N, D].
            updates: done before; noisy weights are drawn anew for each.
            measured: whether to give metrics of the last update.
        """
        ...

    def fit_rollout(
        self, rollout: Rollout, order: NDArray[np.int64], next_observations: FloatArray
    ) -> FitResult:
        """Fit Q(s,a) to the λ-returns of a rollout by K minibatches, one after the other.

        Args:
            rollout: T steps of N environments, in NumPy arrays.
            order: which of its T·N steps each minibatch takes, [K, B].
            next_observations: that actions are chosen for next, [N, D].
        """
        ...

    def copy_target(self) -> None:
        """Θ′ ← Θ (Eq. 5)."""
        ...

    def tensors(self) -> Tensors:
        """All arrays of the state by name, for a checkpoint."""
        ...

    def restore(self, tensors: Mapping[str, NDArray[Any]]) -> None:
        """Set the state to what `tensors` returned.

        Raises:
            ValueError: the names, shapes or types are not those of this learner.
        """
        ...
