"""A rollout (T steps of N environments) and its λ-returns, the targets of PQN, in NumPy.

Its twin is `td.lambda_returns` in JAX.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchdown.config.config import Config

Floats = NDArray[np.float32]


class Rollout(NamedTuple):
    """T steps of N environments, in arrays of NumPy or JAX."""

    o_tm1: Any
    """[T, N, D]"""
    a_tm1: Any
    """[T, N], like all that follow, except for `o_t`."""
    r_t: Any
    o_t: Any
    """[T, N, D]"""
    terminated: Any
    """1 where the episode terminated, else 0."""
    truncated: Any
    """1 where the episode was truncated and not terminated, else 0."""


def rollout_targets(rollout: Rollout, q_t: Floats, config: Config) -> Floats:
    """Gₜ = r + γ·[λ·Gₜ₊₁ + (1 − λ)·maxₐ Q(s′,a)]   (Peng & Williams, 1994; PQN's Q(λ)), [T, N].

    After the last step, and where the episode was truncated, maxₐ Q(s′,a) alone bootstraps.

    Args:
        rollout: T steps of N environments.
        q_t: Q(s′,·) of the observations after its steps, [T·N, A].
        config: settings with γ, λ and the reward scale.
    """
    best = q_t.max(axis=-1).reshape(rollout.r_t.shape)
    reward = rollout.r_t * np.float32(config.learning.reward_scale)
    discount = np.float32(config.learning.gamma) * (1 - rollout.terminated)
    decay = np.float32(config.rollout.trace_decay) * (1 - rollout.truncated)
    targets = np.empty_like(best)
    following = best[-1]
    for t in range(len(best) - 1, -1, -1):
        mixed = decay[t] * following + (1 - decay[t]) * best[t]
        following = targets[t] = reward[t] + discount[t] * mixed
    return targets
