"""Losses of a minibatch for networks that output values, quantiles or atoms."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Float

from touchdown.agents import td
from touchdown.agents.batch import Params, TransitionBatch
from touchdown.agents.learners.noise import UpdateKeys
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import LearningConfig


class Losses(NamedTuple):
    """Results for a minibatch of B transitions."""

    loss: Float[jax.Array, " B"]
    q_tm1: Float[jax.Array, "B A"]
    """Q(s,·) of the online network."""
    td_error: Float[jax.Array, " B"]


LossFunction = Callable[[Params, Params, TransitionBatch, UpdateKeys], Losses]
"""Computes the loss of online and bootstrapping parameters on a minibatch."""


def losses_of(td_error: Float[jax.Array, " B"], kind: str) -> Float[jax.Array, " B"]:
    """δ² (`mse`), or the Huber loss with threshold 1 (`huber`), of each transition."""
    return jnp.square(td_error) if kind == "mse" else optax.huber_loss(td_error)


def make_losses(network: QNetwork, config: LearningConfig) -> LossFunction:
    """The loss function for the network's kind of outputs."""

    def by_values(
        online: Params, bootstrap: Params, batch: TransitionBatch, keys: UpdateKeys
    ) -> Losses:
        q_tm1 = network.apply(online, batch.o_tm1, keys.tm1)
        q_t = jax.lax.stop_gradient(network.apply(bootstrap, batch.o_t, keys.t))
        taken = batch.a_tm1, batch.r_t, batch.discount_t
        if config.double:
            q_t_online = jax.lax.stop_gradient(network.apply(online, batch.o_t, keys.selection))
            td_error = td.double_q_error(q_tm1, *taken, q_t_online, q_t)
        elif config.target == "sarsa":
            td_error = td.sarsa_error(q_tm1, *taken, q_t, batch.a_t)
        else:
            td_error = td.q_error(q_tm1, *taken, q_t)
        return Losses(losses_of(td_error, config.loss), q_tm1, td_error)

    def by_quantiles(
        online: Params, bootstrap: Params, batch: TransitionBatch, keys: UpdateKeys
    ) -> Losses:
        theta_tm1 = network.quantiles(online, batch.o_tm1, keys.tm1)
        theta_t = jax.lax.stop_gradient(network.quantiles(bootstrap, batch.o_t, keys.t))
        taken = td.of_action(theta_tm1, batch.a_tm1)
        best = of_next_action(theta_t, theta_t.mean(axis=-1), online, batch, keys)
        target = batch.r_t[:, None] + batch.discount_t[:, None] * best
        td_error = target.mean(axis=-1) - taken.mean(axis=-1)
        return Losses(td.quantile_loss(taken, target), theta_tm1.mean(axis=-1), td_error)

    def by_atoms(
        online: Params, bootstrap: Params, batch: TransitionBatch, keys: UpdateKeys
    ) -> Losses:
        z = network.support
        log_p_tm1 = network.log_probabilities(online, batch.o_tm1, keys.tm1)
        log_p_t = network.log_probabilities(bootstrap, batch.o_t, keys.t)
        p_t = jax.lax.stop_gradient(jnp.exp(log_p_t))
        taken = td.of_action(log_p_tm1, batch.a_tm1)
        best = of_next_action(p_t, p_t @ z, online, batch, keys)
        target = td.categorical_projection(z, best, batch.r_t, batch.discount_t)
        td_error = target @ z - jnp.exp(taken) @ z
        return Losses(td.categorical_loss(taken, target), jnp.exp(log_p_tm1) @ z, td_error)

    def of_next_action(
        outputs: Float[jax.Array, "B A Z"],
        q_t: Float[jax.Array, "B A"],
        online: Params,
        batch: TransitionBatch,
        keys: UpdateKeys,
    ) -> Float[jax.Array, "B Z"]:
        """The bootstrapping network's outputs for the next action of the TD target."""
        if config.target == "sarsa":
            return td.of_action(outputs, batch.a_t)
        if config.double:
            q_t = network.apply(online, batch.o_t, keys.selection)
        return td.of_action(outputs, jax.lax.stop_gradient(q_t).argmax(axis=-1))

    if network.config.atoms:
        return by_atoms
    return by_quantiles if network.config.quantiles else by_values
