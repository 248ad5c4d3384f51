"""A learner's state: a value that updates replace and checkpoints store."""

from collections.abc import Mapping
from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

from touchdown.agents.batch import Params
from touchdown.agents.learners.optimizer import make_optimizer
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import LearningConfig
from touchdown.core.types import Tensors


class LearnerState(NamedTuple):
    """Everything that an update reads and writes."""

    online_params: Params
    target_params: Params | None
    """None if there is no target network; the online network bootstraps then."""
    opt_state: optax.OptState


class Metrics(NamedTuple):
    """Metrics of one update, with Q and the loss in scaled reward units.

    The loss of a network with atoms is a cross entropy, in nats.
    """

    loss: jax.Array
    mean_q: jax.Array
    max_q: jax.Array
    gradient_norm: jax.Array
    """Before clipping."""

    def to_floats(self, reward_scale: float) -> dict[str, float]:
        """The metrics by name, for the records, with Q in reward units."""
        return {
            "loss": float(self.loss),
            "mean_q": float(self.mean_q) / reward_scale,
            "max_q": float(self.max_q) / reward_scale,
            "gradient_norm": float(self.gradient_norm),
        }


def init_state(network: QNetwork, config: LearningConfig, seed: int) -> LearnerState:
    """A fresh state; the target network starts as a copy of the online one."""
    online = network.init(jax.random.key(seed))
    return LearnerState(
        online_params=online,
        target_params=jnp.array(online, copy=True) if config.has_target else None,
        opt_state=make_optimizer(config).init(online),
    )


def copy_target(state: LearnerState) -> LearnerState:
    """Θ′ ← Θ (Eq. 5)."""
    return state._replace(target_params=state.online_params.copy())


def soft_update(state: LearnerState, rate: float) -> LearnerState:
    """Θ′ ← Θ′ + τ·(Θ − Θ′)   (Polyak averaging; Lillicrap et al., 2016).

    Args:
        state: a state with a target network.
        rate: τ, from 0 to 1.
    """
    difference = optax.tree.sub(state.online_params, state.target_params)
    target_params = optax.tree.add_scale(state.target_params, rate, difference)
    return state._replace(target_params=target_params)


def tensors_of(state: LearnerState) -> Tensors:
    """All arrays of a state by name, for a checkpoint."""
    return {name: np.array(leaf) for name, leaf in _named_leaves(state).items()}


def state_from(like: LearnerState, tensors: Mapping[str, NDArray[Any]]) -> LearnerState:
    """The inverse of `tensors_of`, with arrays of the same kind as those of `like`.

    Raises:
        ValueError: the names, shapes or types are not those of `like`.
    """
    named = _named_leaves(like)
    if named.keys() != tensors.keys():
        raise ValueError(f"it has {sorted(tensors)}, must be {sorted(named)}")
    leaves: list[jax.Array] = []
    for name, leaf in named.items():
        value = tensors[name]
        if value.shape != leaf.shape or value.dtype != leaf.dtype:
            raise ValueError(
                f"{name} is {value.dtype}{value.shape}, must be {leaf.dtype}{leaf.shape}"
            )
        # the fused kernel writes to its state in place, so its arrays are NumPy's
        leaves.append(
            cast(jax.Array, value.copy()) if isinstance(leaf, np.ndarray) else jnp.array(value)
        )
    return cast(LearnerState, jax.tree.unflatten(cast(Any, jax.tree.structure(like)), leaves))


class StateOwner:
    """The part of the `Learner` protocol that does not depend on how updates are computed.

    Args:
        state: initial state; `restore` keeps the kind of its arrays.
    """

    def __init__(self, state: LearnerState) -> None:
        self.state = state

    def copy_target(self) -> None:
        """Θ′ ← Θ (Eq. 5)."""
        self.state = copy_target(self.state)

    def tensors(self) -> Tensors:
        """All arrays of the state by name, for a checkpoint."""
        return tensors_of(self.state)

    def restore(self, tensors: Mapping[str, NDArray[Any]]) -> None:
        """Restore the state that `tensors` returned.

        Raises:
            ValueError: the names, shapes or types are not those of this learner.
        """
        self.state = state_from(self.state, tensors)


def _named_leaves(state: LearnerState) -> dict[str, jax.Array]:
    leaves = cast(list[tuple[Any, jax.Array]], jax.tree.leaves_with_path(state))
    return {jax.tree_util.keystr(path).lstrip("."): leaf for path, leaf in leaves}
