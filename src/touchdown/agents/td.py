"""TD errors: one equation a function, in the field's notation.

Shapes: B transitions, A actions. γ is inside `discount_t`, which is 0 where the world ended; a
truncated step keeps its discount. Nothing here stops gradients: the caller differentiates only
with respect to what it means to learn.
"""

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float, Int


def q_error(
    q_tm1: Float[Array, "B A"],
    a_tm1: Int[Array, " B"],
    r_t: Float[Array, " B"],
    discount_t: Float[Array, " B"],
    q_t: Float[Array, "B A"],
) -> Float[Array, " B"]:
    """δ = r + γ·maxₐ Q(s′,a) − Q(s,a)   (Watkins, 1989; the paper's Eq. 4 and, lagged, Eq. 5).

    Args:
        q_tm1: Q(s,·) of the network that learns.
        a_tm1: actions taken.
        r_t: rewards.
        discount_t: γ, or 0 where the world ended.
        q_t: Q(s′,·) of the network that bootstraps: the same one, or the target network.
    """
    return r_t + discount_t * q_t.max(axis=-1) - value_of(q_tm1, a_tm1)


def double_q_error(
    q_tm1: Float[Array, "B A"],
    a_tm1: Int[Array, " B"],
    r_t: Float[Array, " B"],
    discount_t: Float[Array, " B"],
    q_t_online: Float[Array, "B A"],
    q_t_target: Float[Array, "B A"],
) -> Float[Array, " B"]:
    """δ = r + γ·Q̄(s′, argmaxₐ Q(s′,a)) − Q(s,a)   (van Hasselt, Guez & Silver, 2016).

    Args:
        q_tm1: Q(s,·) of the network that learns.
        a_tm1: actions taken.
        r_t: rewards.
        discount_t: γ, or 0 where the world ended.
        q_t_online: Q(s′,·) of the network that learns: it selects.
        q_t_target: Q̄(s′,·) of the target network: it evaluates.
    """
    bootstrap = value_of(q_t_target, q_t_online.argmax(axis=-1))
    return r_t + discount_t * bootstrap - value_of(q_tm1, a_tm1)


def value_of(q: Float[Array, "B A"], a: Int[Array, " B"]) -> Float[Array, " B"]:
    """Q(s,a) of one action in each row."""
    # a product, not an index: on a CPU the gradient of an index is a slow scatter
    return jnp.sum(q * jax.nn.one_hot(a, q.shape[-1]), axis=-1)
