"""A rollout (T steps of N environments) and its λ-returns, the targets of PQN."""

from typing import NamedTuple

import jax
from jaxtyping import Float, Int

from touchdown.agents import td
from touchdown.config.config import Config


class Rollout(NamedTuple):
    """T steps of N environments, in arrays of NumPy or JAX."""

    o_tm1: Float[jax.Array, "T N D"]
    a_tm1: Int[jax.Array, "T N"]
    r_t: Float[jax.Array, "T N"]
    o_t: Float[jax.Array, "T N D"]
    terminated: Float[jax.Array, "T N"]
    """1 where the episode terminated, else 0."""
    truncated: Float[jax.Array, "T N"]
    """1 where the episode was truncated and not terminated, else 0."""


def rollout_targets(
    rollout: Rollout, q_t: Float[jax.Array, "TN A"], config: Config
) -> Float[jax.Array, "T N"]:
    """λ-returns of a rollout (inside a compiled function).

    Args:
        rollout: T steps of N environments.
        q_t: Q(s′,·) of the observations after its steps.
        config: settings with γ, λ and the reward scale.
    """
    best = q_t.max(axis=-1).reshape(rollout.r_t.shape)
    reward = rollout.r_t * config.learning.reward_scale
    discount = config.learning.gamma * (1 - rollout.terminated)
    decay = config.rollout.trace_decay
    return td.lambda_returns(reward, discount, best, rollout.truncated, decay)
