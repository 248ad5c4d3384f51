"""TD errors: one equation per function, in standard notation.

Shapes: B transitions, A actions, Z quantiles or atoms. γ is inside `discount_t`, which is 0 where
the episode terminated; a truncated step keeps its discount. Nothing here stops gradients: the
caller differentiates only with respect to the parameters that learn.
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
        discount_t: γ, or 0 where the episode terminated.
        q_t: Q(s′,·) of the network that bootstraps: the same one, or the target network.
    """
    return r_t + discount_t * q_t.max(axis=-1) - of_action(q_tm1, a_tm1)


def sarsa_error(
    q_tm1: Float[Array, "B A"],
    a_tm1: Int[Array, " B"],
    r_t: Float[Array, " B"],
    discount_t: Float[Array, " B"],
    q_t: Float[Array, "B A"],
    a_t: Int[Array, " B"],
) -> Float[Array, " B"]:
    """δ = r + γ·Q(s′,a′) − Q(s,a)   (Rummery & Niranjan, 1994; the paper's appendix A).

    Args:
        q_tm1: Q(s,·) of the network that learns.
        a_tm1: actions taken.
        r_t: rewards.
        discount_t: γ, or 0 where the episode terminated.
        q_t: Q(s′,·) of the network that bootstraps.
        a_t: actions that were taken next.
    """
    followed = of_action(q_t, a_t)
    return q_error(q_tm1, a_tm1, r_t, discount_t, followed[:, None])  # the best of one is that one


def double_q_error(
    q_tm1: Float[Array, "B A"],
    a_tm1: Int[Array, " B"],
    r_t: Float[Array, " B"],
    discount_t: Float[Array, " B"],
    q_t_online: Float[Array, "B A"],
    q_t_target: Float[Array, "B A"],
) -> Float[Array, " B"]:
    """δ = r + γ·Q̄(s′, argmaxₐ Q(s′,a)) − Q(s,a)   (van Hasselt, Guez & Silver, 2016).

    Args as in `q_error`, except:
        q_t_online: Q(s′,·) of the network that learns: it selects.
        q_t_target: Q̄(s′,·) of the target network: it evaluates.
    """
    selected = of_action(q_t_target, q_t_online.argmax(axis=-1))
    return q_error(q_tm1, a_tm1, r_t, discount_t, selected[:, None])  # the best of one is that one


def lambda_returns(
    r_t: Float[Array, "T N"],
    discount_t: Float[Array, "T N"],
    best_t: Float[Array, "T N"],
    truncated: Float[Array, "T N"],
    trace_decay: float,
) -> Float[Array, "T N"]:
    """Gₜ = r + γ·[λ·Gₜ₊₁ + (1 − λ)·maxₐ Q(s′,a)]   (Peng & Williams, 1994; PQN's Q(λ)).

    After the last step, and where the episode was truncated, maxₐ Q(s′,a) alone bootstraps.

    Args:
        r_t: rewards of T steps.
        discount_t: γ, or 0 where the episode terminated.
        best_t: maxₐ Q(s′,a).
        truncated: 1 where the episode was truncated, else 0.
        trace_decay: λ.
    """

    def back(
        following: Float[Array, " N"], step: tuple[Array, Array, Array, Array]
    ) -> tuple[Float[Array, " N"], Float[Array, " N"]]:
        reward, discount, best, cut = step
        decay = trace_decay * (1 - cut)
        value = reward + discount * (decay * following + (1 - decay) * best)
        return value, value

    steps = r_t, discount_t, best_t, truncated
    return jax.lax.scan(back, best_t[-1], steps, reverse=True)[1]


def quantile_loss(
    theta_tm1: Float[Array, "B Z"], target: Float[Array, "B T"]
) -> Float[Array, " B"]:
    """Σᵢ meanⱼ |τᵢ − 1{uᵢⱼ < 0}| · Huber(uᵢⱼ), uᵢⱼ = targetⱼ − θᵢ   (Dabney et al., 2018, Eq. 10).

    Args:
        theta_tm1: quantiles of the return of the action taken, at τᵢ = (i + ½) / Z.
        target: r + γ·θ′ⱼ, the target quantiles.
    """
    count = theta_tm1.shape[-1]
    tau = (jnp.arange(count) + 0.5) / count
    u = target[:, None, :] - theta_tm1[:, :, None]  # [B, Z, T]
    slope = jnp.abs(tau[None, :, None] - (u < 0))
    return jnp.sum(jnp.mean(slope * optax.huber_loss(u), axis=2), axis=1)


def categorical_projection(
    support: Float[Array, " Z"],
    p_t: Float[Array, "B Z"],
    r_t: Float[Array, " B"],
    discount_t: Float[Array, " B"],
) -> Float[Array, "B Z"]:
    """Φᵢ = Σⱼ pⱼ·[1 − |r + γ·zⱼ − zᵢ| / Δz]₀   (Bellemare, Dabney & Munos, 2017, Eq. 7).

    The probability of r + γ·zⱼ, clipped to the support, is shared between its two nearest atoms.

    Args:
        support: z, the atoms in increasing order, spaced Δz apart.
        p_t: probabilities of the atoms at s′.
        r_t: rewards.
        discount_t: γ, or 0 where the episode terminated.
    """
    count = len(support)
    least, greatest = support[0], support[-1]
    moved = jnp.clip(r_t[:, None] + discount_t[:, None] * support, least, greatest)  # [B, Zⱼ]
    place = (moved - least) * ((count - 1) / (greatest - least))  # bⱼ, from 0 to Z − 1
    # a product over all pairs, not a scatter to two places: faster on a CPU, same on any device
    share = jnp.maximum(1 - jnp.abs(place[:, :, None] - jnp.arange(count)), 0)  # [B, Zⱼ, Zᵢ]
    return jnp.einsum("bji,bj->bi", share, p_t, precision="highest")


def categorical_loss(
    log_p_tm1: Float[Array, "B Z"], target_p: Float[Array, "B Z"]
) -> Float[Array, " B"]:
    """−Σᵢ Φᵢ·log pᵢ(s,a)   (Bellemare, Dabney & Munos, 2017, Algorithm 1).

    Args:
        log_p_tm1: logarithms of the atoms' probabilities for the action taken.
        target_p: Φ, the projected target probabilities.
    """
    return -jnp.sum(target_p * log_p_tm1, axis=-1)


def of_action(outputs: Float[Array, "B A ..."], a: Int[Array, " B"]) -> Float[Array, "B ..."]:
    """Q(s,a), or θ(s,a), of one action in each row."""
    # a product, not an index, because on a CPU the gradient of an index is a slow scatter
    chosen = jax.nn.one_hot(a, outputs.shape[1])
    return jnp.sum(outputs * jnp.expand_dims(chosen, tuple(range(2, outputs.ndim))), axis=1)
