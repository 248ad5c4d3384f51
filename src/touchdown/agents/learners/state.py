"""A learner's state: a value that updates replace and checkpoints store."""

from collections.abc import Mapping
from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

from touchdown.agents.batch import Params
from touchdown.agents.learners.learner import check_tensors
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
    """The inverse of `tensors_of`, for the structure of `like`.

    Raises:
        ValueError: the names, shapes or types are not those of `like`.
    """
    check_tensors(tensors, tensors_of(like))
    leaves = [jnp.array(tensors[name]) for name in _named_leaves(like)]
    return cast(LearnerState, jax.tree.unflatten(cast(Any, jax.tree.structure(like)), leaves))


def _named_leaves(state: LearnerState) -> dict[str, jax.Array]:
    leaves = cast(list[tuple[Any, jax.Array]], jax.tree.leaves_with_path(state))
    return {jax.tree_util.keystr(path).lstrip("."): leaf for path, leaf in leaves}
