"""Q-networks: observations in, one value an action out."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from typing import Any, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Float, PRNGKeyArray
from numpy.typing import NDArray

from touchdown.agents.batch import Params
from touchdown.config.sections import NetworkConfig
from touchdown.core.types import FloatArray, IntArray

_ROWS = 32  # observations in one call of a greedy policy
_KINDS = ("weight", "bias")
_NOISY_KINDS = (*_KINDS, "weight_sigma", "bias_sigma")
_ACTIVATIONS = {"relu": jax.nn.relu, "tanh": jax.nn.tanh, "silu": jax.nn.silu}


class NoisyLinear(eqx.Module):
    """y = (µʷ + σʷ ⊙ f(ε)·f(ε′)ᵀ)·x + µᵇ + σᵇ ⊙ f(ε)   (Fortunato et al., 2018, Eq. 9-11).

    Its noise is factorised: of normal ε [out] and ε′ [in], through f(x) = sgn(x)·√|x|.
    """

    weight: Float[jax.Array, "out in"]
    bias: Float[jax.Array, " out"]
    weight_sigma: Float[jax.Array, "out in"]
    bias_sigma: Float[jax.Array, " out"]

    def __init__(self, fan_in: int, fan_out: int, *, sigma: float, key: PRNGKeyArray) -> None:
        means = eqx.nn.Linear(fan_in, fan_out, key=key)  # uniform in ±1/√(fan in), as the source's
        self.weight, self.bias = means.weight, cast(jax.Array, means.bias)
        self.weight_sigma = jnp.full_like(self.weight, sigma / math.sqrt(fan_in))
        self.bias_sigma = jnp.full_like(self.bias, sigma / math.sqrt(fan_in))

    def __call__(
        self, x: Float[jax.Array, " in"], *, key: PRNGKeyArray | None = None
    ) -> Float[jax.Array, " out"]:
        """The layer's output with the noise that a key draws; without a key, by the means."""
        if key is None:
            return self.weight @ x + self.bias
        fan_out, fan_in = self.weight.shape
        noise = jax.random.normal(key, (fan_out + fan_in,))
        noise = jnp.sign(noise) * jnp.sqrt(jnp.abs(noise))
        after, before = noise[:fan_out], noise[fan_out:]
        # weights are drawn whole, not multiplied apart: a batch shares them, so it pays once
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
        """Q(s,·) of one state's features; of several outputs an action, each on its own."""
        value_key, advantage_key = (None, None) if key is None else jax.random.split(key)
        advantage = self.advantage(features, key=advantage_key).reshape(self.num_actions, -1)
        q = self.value(features, key=value_key) + advantage - advantage.mean(axis=0)
        return q.ravel()


class QNetwork:
    """A multilayer perceptron as functions of one flat vector of parameters.

    Args:
        observation_size: D, inputs.
        num_actions: A, outputs.
        config: layers and head; no hidden layer makes Q linear in the observation.
    """

    def __init__(self, observation_size: int, num_actions: int, config: NetworkConfig) -> None:
        self.observation_size = observation_size
        self.num_actions = num_actions
        self.config = config
        module = self._module(jax.random.key(0))
        arrays, self._static = _split(module)
        flat, self._unravel = ravel_pytree(arrays)
        shapes = [leaf.shape for leaf in jax.tree.leaves(arrays)]
        self._shapes = dict(zip(_names(module), shapes, strict=True))
        self.num_params = int(flat.size)
        self.values = jax.jit(self.apply)
        """`apply`, compiled once for everyone who flies this network."""

    def _module(self, key: PRNGKeyArray) -> eqx.nn.Sequential:
        config = self.config
        sizes = (self.observation_size, *config.hidden_sizes)
        *keys, head_key = jax.random.split(key, len(sizes))
        linear: Callable[..., eqx.nn.Linear | NoisyLinear] = eqx.nn.Linear
        if config.noisy:
            linear = partial(NoisyLinear, sigma=config.noisy_sigma)
        layers: list[Any] = []
        for fan_in, fan_out, layer_key in zip(sizes, sizes[1:], keys, strict=False):
            layers.append(linear(fan_in, fan_out, key=layer_key))
            if config.layer_norm:
                layers.append(eqx.nn.LayerNorm(fan_out))
            layers.append(eqx.nn.Lambda(_ACTIVATIONS[config.activation]))
        outputs = max(1, config.quantiles, config.atoms)
        if config.dueling:
            layers.append(DuelingHead(sizes[-1], self.num_actions, outputs, linear, key=head_key))
        else:
            layers.append(linear(sizes[-1], self.num_actions * outputs, key=head_key))
        return eqx.nn.Sequential(layers)

    def init(self, key: PRNGKeyArray) -> Params:
        """Fresh parameters: uniform in ±1/√(fan in), σ of noisy ones σ₀/√(fan in)."""
        return ravel_pytree(_split(self._module(key))[0])[0]

    @property
    def support(self) -> Float[jax.Array, " Z"]:
        """z: the returns that the atoms stand for, at equal distances from v_min to v_max."""
        return jnp.linspace(self.config.v_min, self.config.v_max, self.config.atoms)

    def apply(
        self,
        params: Params,
        observations: Float[jax.Array, "B D"],
        noise: PRNGKeyArray | None = None,
    ) -> Float[jax.Array, "B A"]:
        """Q(s,·) of each observation; of several outputs an action, the mean that they stand for.

        Args:
            params: flat, [P].
            observations: any number of them.
            noise: key of the one sample of noisy weights for all; without it they are their means.
        """
        outputs = self._outputs(params, observations, noise)
        if self.config.atoms:
            return jax.nn.softmax(self._by_action(outputs)) @ self.support
        return self._by_action(outputs).mean(axis=-1) if self.config.quantiles else outputs

    def quantiles(
        self,
        params: Params,
        observations: Float[jax.Array, "B D"],
        noise: PRNGKeyArray | None = None,
    ) -> Float[jax.Array, "B A Z"]:
        """Quantiles of the return of each action, for a network that has them."""
        return self._by_action(self._outputs(params, observations, noise))

    def log_probabilities(
        self,
        params: Params,
        observations: Float[jax.Array, "B D"],
        noise: PRNGKeyArray | None = None,
    ) -> Float[jax.Array, "B A Z"]:
        """Logarithms of each atom's probability for each action, for a network that has atoms."""
        return jax.nn.log_softmax(self._by_action(self._outputs(params, observations, noise)))

    def _by_action(self, outputs: Float[jax.Array, "B AZ"]) -> Float[jax.Array, "B A Z"]:
        return outputs.reshape(len(outputs), self.num_actions, -1)

    def _outputs(
        self, params: Params, observations: Float[jax.Array, "B D"], noise: PRNGKeyArray | None
    ) -> jax.Array:
        module = cast(eqx.nn.Sequential, eqx.combine(self._unravel(params), self._static))
        return jax.vmap(partial(module, key=noise))(observations)

    def values_of_each(self, params: Params, observations: FloatArray) -> NDArray[Any]:
        """Q(s,·) of any number of observations, [N, D] to [N, A]: of each as it would be alone."""

        def values_of(block: FloatArray) -> NDArray[Any]:
            return np.asarray(cast(jax.Array, self.values(params, block)))

        return in_blocks(values_of, observations)

    def policy(self, params: FloatArray) -> "GreedyPolicy":
        """Flies these parameters [P] without exploring."""
        return GreedyPolicy(self, params)

    def describe(self) -> dict[str, Any]:
        """The network's config, by the key that a file of weights has it under."""
        return {"network": asdict(self.config)}

    def layers(self, params: Params | FloatArray) -> dict[str, jax.Array]:
        """Parameters by name: `layers.0.weight` [out, in], `layers.0.bias` [out], and so on.

        Of a normalisation `norms.0.weight`; of a dueling head `value.weight`, `advantage.weight`;
        of noisy weights also `layers.0.weight_sigma`, `layers.0.bias_sigma`.
        """
        leaves = jax.tree.leaves(self._unravel(jnp.asarray(params)))
        return dict(zip(self._shapes, leaves, strict=True))

    def params_of(self, layers: Mapping[str, FloatArray]) -> NDArray[np.float32]:
        """Flat parameters from those that `layers` names.

        Raises:
            ValueError: they are others than this network's, or of other shapes or types.
        """
        wanted = self._shapes
        if layers.keys() != wanted.keys():
            raise ValueError(f"it holds {sorted(layers)}, the network needs {sorted(wanted)}")
        for name, shape in wanted.items():
            given = layers[name]
            if given.shape != shape or given.dtype != np.float32:
                raise ValueError(f"{name} is {given.dtype}{given.shape}, must be float32{shape}")
        return np.concatenate([layers[name].ravel() for name in wanted])


def _names(module: eqx.nn.Sequential) -> list[str]:
    """The parameters' names in the order in which they lie in the flat vector."""
    counts: dict[str, int] = {}
    names: list[str] = []
    for layer in cast(tuple[object, ...], module.layers):
        if isinstance(layer, DuelingHead):
            names += _named("value", layer.value) + _named("advantage", layer.advantage)
        elif isinstance(layer, eqx.nn.Linear | NoisyLinear | eqx.nn.LayerNorm):
            group = "norms" if isinstance(layer, eqx.nn.LayerNorm) else "layers"
            number = counts[group] = counts.get(group, -1) + 1
            names += _named(f"{group}.{number}", layer)
    return names


def _named(name: str, layer: object) -> list[str]:
    kinds = _NOISY_KINDS if isinstance(layer, NoisyLinear) else _KINDS
    return [f"{name}.{kind}" for kind in kinds]


class GreedyPolicy:
    """Flies a trained network without exploring.

    Args:
        network: the shape.
        params: its flat parameters, [P].
    """

    def __init__(self, network: QNetwork, params: FloatArray) -> None:
        self._params = jnp.asarray(params)
        self._network = network

    def act(self, observations: FloatArray) -> IntArray:
        """The best action of each observation: [N, D] to [N]."""
        return self.values(observations).argmax(axis=1)

    def values(self, observations: FloatArray) -> FloatArray:
        """Q(s,·) of each observation: [N, D] to [N, A]."""
        return self._network.values_of_each(self._params, observations)


def in_blocks(
    function: Callable[[NDArray[np.float32]], NDArray[Any]],
    observations: FloatArray,
    rows: int = _ROWS,
) -> NDArray[Any]:
    """A function of observations, called for blocks of as many each time.

    So one compilation serves all calls, and what comes of an observation does not depend on how
    many came along (another shape may round another way).

    Args:
        function: [rows, D] to [rows, ...].
        observations: [N, D], 1 or more.
        rows: in a block; the last is filled up with zeros.

    Returns:
        [N, ...].
    """
    results: list[NDArray[Any]] = []
    for first in range(0, len(observations), rows):
        some = observations[first : first + rows]
        padded = np.zeros((rows, some.shape[1]), np.float32)
        padded[: len(some)] = some
        results.append(function(padded)[: len(some)])
    return np.concatenate(results)


def _split(module: eqx.Module) -> tuple[Any, Any]:
    """A module's arrays, and the rest of it."""
    return cast(tuple[Any, Any], eqx.partition(module, eqx.is_array))
