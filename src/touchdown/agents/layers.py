"""Layers that Equinox does not have: noisy linear layers and the dueling head."""

import math
from collections.abc import Callable
from typing import cast

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray


class NoisyLinear(eqx.Module):
    """y = (µʷ + σʷ ⊙ f(ε)·f(ε′)ᵀ)·x + µᵇ + σᵇ ⊙ f(ε)   (Fortunato et al., 2018, Eq. 9-11).

    The noise is factorised: normal ε [out] and ε′ [in], with f(x) = sgn(x)·√|x|.
    """

    weight: Float[jax.Array, "out in"]
    bias: Float[jax.Array, " out"]
    weight_sigma: Float[jax.Array, "out in"]
    bias_sigma: Float[jax.Array, " out"]

    def __init__(self, fan_in: int, fan_out: int, *, sigma: float, key: PRNGKeyArray) -> None:
        means = eqx.nn.Linear(fan_in, fan_out, key=key)  # uniform in ±1/√(fan in), as in the source
        self.weight, self.bias = means.weight, cast(jax.Array, means.bias)
        self.weight_sigma = jnp.full_like(self.weight, sigma / math.sqrt(fan_in))
        self.bias_sigma = jnp.full_like(self.bias, sigma / math.sqrt(fan_in))

    def __call__(
        self, x: Float[jax.Array, " in"], *, key: PRNGKeyArray | None = None
    ) -> Float[jax.Array, " out"]:
        """The layer's output, with noise from the key, or with mean weights without a key."""
        if key is None:
            return self.weight @ x + self.bias
        fan_out, fan_in = self.weight.shape
        noise = jax.random.normal(key, (fan_out + fan_in,))
        noise = jnp.sign(noise) * jnp.sqrt(jnp.abs(noise))
        after, before = noise[:fan_out], noise[fan_out:]
        # a batch shares one sample, so it is cheaper to make the noisy weights once
        weight = self.weight + self.weight_sigma * jnp.outer(after, before)
        return weight @ x + (self.bias + self.bias_sigma * after)


class DuelingHead(eqx.Module):
    """Q(s,a) = V(s) + A(s,a) − mean A(s,·)   (Wang et al., 2016, Eq. 9)."""

    value: eqx.nn.Linear | NoisyLinear
    advantage: eqx.nn.Linear | NoisyLinear
    num_actions: int = eqx.field(static=True)

    def __init__(
        self,
        fan_in: int,
        num_actions: int,
        outputs: int = 1,
        linear: Callable[..., eqx.nn.Linear | NoisyLinear] = eqx.nn.Linear,
        *,
        key: PRNGKeyArray,
    ) -> None:
        value_key, advantage_key = jax.random.split(key)
        self.num_actions = num_actions
        self.value = linear(fan_in, outputs, key=value_key)
        self.advantage = linear(fan_in, num_actions * outputs, key=advantage_key)

    def __call__(
        self, features: Float[jax.Array, " F"], *, key: PRNGKeyArray | None = None
    ) -> Float[jax.Array, " AZ"]:
        """Q(s,·) of one state's features, for each output if an action has several."""
        value_key, advantage_key = (None, None) if key is None else jax.random.split(key)
        advantage = self.advantage(features, key=advantage_key).reshape(self.num_actions, -1)
        q = self.value(features, key=value_key) + advantage - advantage.mean(axis=0)
        return q.ravel()
