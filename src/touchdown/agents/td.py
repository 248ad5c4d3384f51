"""TD errors: one equation a function, in the field's notation.

Shapes: B transitions, A actions. γ is inside `discount_t`, which is 0 where the world ended; a
truncated step keeps its discount. Nothing here stops gradients: the caller differentiates only
with respect to what it means to learn.
"""

import jax
import jax.numpy as jnp
import optax
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


def quantile_loss(
    theta_tm1: Float[Array, "B Z"], target: Float[Array, "B T"]
) -> Float[Array, " B"]:
    """Σᵢ meanⱼ |τᵢ − 1{uᵢⱼ < 0}| · Huber(uᵢⱼ), uᵢⱼ = targetⱼ − θᵢ   (Dabney et al., 2018, Eq. 10).

    Args:
        theta_tm1: quantiles of the return of the action taken, at τᵢ = (i + ½) / Z.
        target: r + γ·θ′ⱼ, quantiles of what they are pulled to.
    """
    count = theta_tm1.shape[-1]
    tau = (jnp.arange(count) + 0.5) / count
    u = target[:, None, :] - theta_tm1[:, :, None]  # [B, Z, T]
    slope = jnp.abs(tau[None, :, None] - (u < 0))
    return jnp.sum(jnp.mean(slope * optax.huber_loss(u), axis=2), axis=1)


def quantiles_of(theta: Float[Array, "B A Z"], a: Int[Array, " B"]) -> Float[Array, "B Z"]:
    """θ(s,a) of one action in each row."""
    return jnp.sum(theta * jax.nn.one_hot(a, theta.shape[1])[:, :, None], axis=1)


def value_of(q: Float[Array, "B A"], a: Int[Array, " B"]) -> Float[Array, " B"]:
    """Q(s,a) of one action in each row."""
    # a product, not an index: on a CPU the gradient of an index is a slow scatter
    return jnp.sum(q * jax.nn.one_hot(a, q.shape[-1]), axis=-1)
