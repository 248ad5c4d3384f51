"""Pure updates in JAX, which return a new learner state (Algorithm 2, lines 7-12)."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Float, Int, PRNGKeyArray

from touchdown.agents import td
from touchdown.agents.batch import Params, TransitionBatch, unpack_transitions
from touchdown.agents.learners.learner import Metrics
from touchdown.agents.learners.losses import LossFunction, losses_of, make_losses
from touchdown.agents.learners.noise import UpdateKeys, update_keys
from touchdown.agents.learners.optimizer import make_optimizer
from touchdown.agents.learners.state import LearnerState, soft_update
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import LearningConfig

Packed = Float[jax.Array, "B W"]
Weights = Float[jax.Array, " B"]


class Updated(NamedTuple):
    """The result of an update."""

    state: LearnerState
    metrics: Metrics | None
    td_error: Float[jax.Array, " B"]
    """With the parameters before the update."""


class Update(Protocol):
    """Computes a new learner state from a minibatch."""

    def __call__(
        self,
        state: LearnerState,
        packed: Packed,
        weights: Weights | None,
        measured: bool,
        noise: PRNGKeyArray | None = None,
    ) -> Updated:
        """Update once.

        Args:
            state: the state before the update.
            packed: a minibatch of packed transitions.
            weights: importance-sampling weights, or None.
            measured: whether to return metrics.
            noise: the key for noisy weights, None if the network has none.
        """
        ...


Fit = Callable[
    [LearnerState, Float[jax.Array, "B D"], Int[jax.Array, " B"], Float[jax.Array, " B"]],
    tuple[LearnerState, Metrics],
]
"""Computes a new learner state from observations, actions and targets of their values."""


def make_update(
    network: QNetwork, config: LearningConfig, losses: LossFunction | None = None
) -> Update:
    """A pure update with one minibatch, for the caller to compile.

    Its argument `measured` must be static: computing metrics that nobody records would take 5%
    of the update's time.

    Args:
        network: to update.
        config: of the update.
        losses: of a minibatch; None takes the config's.
    """
    optimizer = make_optimizer(config)
    losses_and_q = losses or make_losses(network, config)

    def loss_and_q(
        online: Params,
        bootstrap: Params,
        batch: TransitionBatch,
        weights: Weights | None,
        keys: UpdateKeys,
    ) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
        scaled = batch._replace(r_t=batch.r_t * config.reward_scale)
        losses, q_tm1, td_error = losses_and_q(online, bootstrap, scaled, keys)
        loss = jnp.mean(losses if weights is None else weights * losses)
        return loss, (q_tm1, td_error)

    def update(
        state: LearnerState,
        packed: Packed,
        weights: Weights | None,
        measured: bool,
        noise: PRNGKeyArray | None = None,
    ) -> Updated:
        batch = unpack_transitions(packed, network.observation_size)
        online = state.online_params
        bootstrap = online if state.target_params is None else state.target_params
        gradient_of = jax.value_and_grad(loss_and_q, has_aux=True)
        keys = update_keys(noise)
        (loss, (q_tm1, td_error)), gradient = gradient_of(online, bootstrap, batch, weights, keys)
        step, opt_state = optimizer.update(gradient, state.opt_state, online)
        new_state = state._replace(
            online_params=optax.apply_updates(online, step),
            opt_state=opt_state,
        )
        if config.polyak:
            new_state = soft_update(new_state, config.polyak)
        if not measured:
            return Updated(new_state, None, td_error)
        metrics = Metrics(loss, q_tm1.mean(), q_tm1.max(), jnp.linalg.norm(gradient))
        return Updated(new_state, metrics, td_error)

    return update


def make_fit(network: QNetwork, config: LearningConfig) -> Fit:
    """A pure update of Q(s,a) towards given targets, for the caller to compile."""
    optimizer = make_optimizer(config)

    def loss_and_q(
        online: Params,
        o_tm1: Float[jax.Array, "B D"],
        a_tm1: Int[jax.Array, " B"],
        target: Float[jax.Array, " B"],
    ) -> tuple[jax.Array, jax.Array]:
        q_tm1 = network.apply(online, o_tm1)
        td_error = target - td.of_action(q_tm1, a_tm1)
        return jnp.mean(losses_of(td_error, config.loss)), q_tm1

    def fit(
        state: LearnerState,
        o_tm1: Float[jax.Array, "B D"],
        a_tm1: Int[jax.Array, " B"],
        target: Float[jax.Array, " B"],
    ) -> tuple[LearnerState, Metrics]:
        online = state.online_params
        gradient_of = jax.value_and_grad(loss_and_q, has_aux=True)
        (loss, q_tm1), gradient = gradient_of(online, o_tm1, a_tm1, target)
        step, opt_state = optimizer.update(gradient, state.opt_state, online)
        metrics = Metrics(loss, q_tm1.mean(), q_tm1.max(), jnp.linalg.norm(gradient))
        online = optax.apply_updates(online, step)
        return state._replace(online_params=online, opt_state=opt_state), metrics

    return fit
