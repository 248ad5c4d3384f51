"""Munchausen-DQN (Vieillard, Pietquin & Geist, 2020), an agent written outside touchdown."""

from typing import Any

import jax
import jax.numpy as jnp

from touchdown.agents.batch import Params, TransitionBatch
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners.jax import JaxLearner
from touchdown.agents.learners.losses import Losses, losses_of
from touchdown.agents.learners.noise import UpdateKeys
from touchdown.agents.networks import make_network
from touchdown.agents.td import of_action
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.core.types import Spaces


def munchausen_error(
    q_tm1: jax.Array,
    a_tm1: jax.Array,
    r_t: jax.Array,
    discount_t: jax.Array,
    q_tm1_target: jax.Array,
    q_t_target: jax.Array,
    *,
    alpha: float,
    tau: float,
    floor: float,
) -> jax.Array:
    """δ = r + α·[τ·ln π(a|s)] + γ·Σ π(a′|s′)·(Q̄(s′,a′) − τ·ln π(a′|s′)) − Q(s,a).

    π = softmax(Q̄/τ), and [·] is clipped to [floor, 0]. Values are [B, A], the rest is [B].
    """
    log_pi_tm1 = jax.nn.log_softmax(q_tm1_target / tau)
    log_pi_t = jax.nn.log_softmax(q_t_target / tau)
    bonus = alpha * jnp.clip(tau * of_action(log_pi_tm1, a_tm1), floor, 0.0)
    soft_value = jnp.sum(jnp.exp(log_pi_t) * (q_t_target - tau * log_pi_t), axis=-1)
    return r_t + bonus + discount_t * soft_value - of_action(q_tm1, a_tm1)


class MunchausenDQN(DQNAgent):
    """DQN whose reward includes the scaled log-probability of the action taken.

    Args:
        config: all settings; it needs a target network, and no quantiles, atoms or noise.
        spaces: the environment's sizes.
        streams: the run's generators.
        alpha: α, the weight of the log-policy.
        tau: τ, the temperature of the policy, in units of the scaled reward.
        floor: lower bound of the log-policy's term, in units of the scaled reward.
    """

    def __init__(
        self,
        config: Config,
        spaces: Spaces,
        streams: Streams,
        *,
        alpha: float = 0.9,
        tau: float = 0.03,
        floor: float = -1.0,
    ) -> None:
        if not tau > 0:
            raise ValueError(f"tau = {tau}: must be above 0")
        network = make_network(config.network, spaces)
        constants: dict[str, Any] = {"alpha": alpha, "tau": tau, "floor": floor}

        def losses(online: Params, target: Params, batch: TransitionBatch, _: UpdateKeys) -> Losses:
            q_tm1 = network.apply(online, batch.o_tm1)
            targets = (network.apply(target, each) for each in (batch.o_tm1, batch.o_t))
            q_tm1_target, q_t_target = map(jax.lax.stop_gradient, targets)
            taken = batch.a_tm1, batch.r_t, batch.discount_t
            td_error = munchausen_error(q_tm1, *taken, q_tm1_target, q_t_target, **constants)
            return Losses(losses_of(td_error, config.learning.loss), q_tm1, td_error)

        super().__init__(config, spaces, streams, JaxLearner(network, config, losses))
