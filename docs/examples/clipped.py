"""Clipped double Q-learning (Fujimoto, van Hoof & Meger, 2018), written outside touchdown."""

import jax
import jax.numpy as jnp

from touchdown.agents.batch import Params, TransitionBatch
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners.jax import JaxLearner
from touchdown.agents.learners.losses import Losses, losses_of
from touchdown.agents.learners.noise import UpdateKeys
from touchdown.agents.networks import make_network
from touchdown.agents.td import of_action, q_error
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.core.types import Spaces


def clipped_double_q_error(
    q_tm1: jax.Array,
    a_tm1: jax.Array,
    r_t: jax.Array,
    discount_t: jax.Array,
    q_t_online: jax.Array,
    q_t_target: jax.Array,
) -> jax.Array:
    """δ = r + γ·min(Q̄(s′,a*), Q(s′,a*)) − Q(s,a), a* = argmaxₐ Q(s′,a).

    Values are [B, A], the rest is [B].
    """
    best = q_t_online.argmax(axis=-1)
    lesser = jnp.minimum(of_action(q_t_target, best), of_action(q_t_online, best))
    return q_error(q_tm1, a_tm1, r_t, discount_t, lesser[:, None])


class ClippedDoubleDQN(DQNAgent):
    """DQN with the smaller of both networks' values of the next action."""

    def __init__(self, config: Config, spaces: Spaces, streams: Streams) -> None:
        network = make_network(config.network, spaces)

        def losses(online: Params, target: Params, batch: TransitionBatch, _: UpdateKeys) -> Losses:
            q_tm1 = network.apply(online, batch.o_tm1)
            q_t_online = jax.lax.stop_gradient(network.apply(online, batch.o_t))
            q_t_target = jax.lax.stop_gradient(network.apply(target, batch.o_t))
            taken = batch.a_tm1, batch.r_t, batch.discount_t
            td_error = clipped_double_q_error(q_tm1, *taken, q_t_online, q_t_target)
            return Losses(losses_of(td_error, config.learning.loss), q_tm1, td_error)

        super().__init__(config, spaces, streams, JaxLearner(network, config, losses))
