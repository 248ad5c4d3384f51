"""The protocol of a learner, as agents use it, and what its updates return."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.model import Model
from touchdown.agents.rollout import Rollout
from touchdown.core.types import FloatArray, Tensors


class Metrics(NamedTuple):
    """Metrics of one update, with Q and the loss in scaled reward units; numbers, or JAX's scalars.

    The loss of a network with atoms is a cross entropy, in nats.
    """

    loss: Any
    mean_q: Any
    max_q: Any
    gradient_norm: Any
    """Before clipping."""

    def to_floats(self, reward_scale: float) -> dict[str, float]:
        """The metrics by name, for the records, with Q in reward units."""
        return {
            "loss": float(self.loss),
            "mean_q": float(self.mean_q) / reward_scale,
            "max_q": float(self.max_q) / reward_scale,
            "gradient_norm": float(self.gradient_norm),
        }


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


class State(Protocol):
    """The part of a learner's state that agents read."""

    @property
    def online_params(self) -> Any:
        """The online network's parameters, [P]; a later update may write to the array."""
        ...


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
    def state(self) -> State:
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


def check_tensors(tensors: Mapping[str, NDArray[Any]], like: Mapping[str, NDArray[Any]]) -> None:
    """Check that restored arrays have the names, shapes and types of a learner's own.

    Raises:
        ValueError: they do not.
    """
    if like.keys() != tensors.keys():
        raise ValueError(f"it has {sorted(tensors)}, must be {sorted(like)}")
    for name, own in like.items():
        value = tensors[name]
        if value.shape != own.shape or value.dtype != own.dtype:
            raise ValueError(
                f"{name} is {value.dtype}{value.shape}, must be {own.dtype}{own.shape}"
            )
