"""Q-networks: from an observation to the value of each action."""

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
from touchdown.agents.greedy import GreedyPolicy, in_blocks
from touchdown.agents.layers import DuelingHead, NoisyLinear
from touchdown.agents.layout import Layout
from touchdown.config.sections import NetworkConfig
from touchdown.core import device
from touchdown.core.types import FloatArray, Spaces

_ACTIVATIONS = {"relu": jax.nn.relu, "tanh": jax.nn.tanh, "silu": jax.nn.silu}


class QNetwork:
    """A multilayer perceptron as functions of one flat parameter vector.

    Args:
        observation_size: D, inputs.
        num_actions: A, outputs.
        config: layers and head; without hidden layers, Q is linear in the observation.

    Raises:
        UserError: this process was forked after JAX had started.
    """

    def __init__(self, observation_size: int, num_actions: int, config: NetworkConfig) -> None:
        device.start()
        self.observation_size = observation_size
        self.num_actions = num_actions
        self.config = config
        self.layout = Layout(observation_size, num_actions, config)
        arrays, self._static = _split(self._fresh(jax.random.key(0)))
        self._unravel = ravel_pytree(arrays)[1]
        self.num_params = self.layout.num_params
        self.values = jax.jit(self.apply)
        """`apply`, compiled once for all users of this network."""

    def _fresh(self, key: PRNGKeyArray) -> eqx.nn.Sequential:
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
        """Initial parameters: uniform in ±1/√(fan in); noisy weights have σ = σ₀/√(fan in)."""
        return ravel_pytree(_split(self._fresh(key))[0])[0]

    @property
    def support(self) -> Float[jax.Array, " Z"]:
        """z: returns of the atoms, equally spaced from v_min to v_max."""
        return jnp.linspace(self.config.v_min, self.config.v_max, self.config.atoms)

    def apply(
        self,
        params: Params,
        observations: Float[jax.Array, "B D"],
        noise: PRNGKeyArray | None = None,
    ) -> Float[jax.Array, "B A"]:
        """Q(s,·) of each observation; the mean return if an action has several outputs.

        Args:
            params: flat parameters, [P].
            observations: any number of observations.
            noise: key of one sample of noisy weights for the whole batch; None uses their means.
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
        """Quantiles of each action's return, for a network with `quantiles`."""
        return self._by_action(self._outputs(params, observations, noise))

    def log_probabilities(
        self,
        params: Params,
        observations: Float[jax.Array, "B D"],
        noise: PRNGKeyArray | None = None,
    ) -> Float[jax.Array, "B A Z"]:
        """Log-probabilities of each action's atoms, for a network with `atoms`."""
        return jax.nn.log_softmax(self._by_action(self._outputs(params, observations, noise)))

    def _by_action(self, outputs: Float[jax.Array, "B AZ"]) -> Float[jax.Array, "B A Z"]:
        return outputs.reshape(len(outputs), self.num_actions, -1)

    def _outputs(
        self, params: Params, observations: Float[jax.Array, "B D"], noise: PRNGKeyArray | None
    ) -> jax.Array:
        return jax.vmap(partial(self.module(params), key=noise))(observations)

    def module(self, params: Any) -> eqx.nn.Sequential:
        """The layers with flat parameters [P]."""
        return cast(eqx.nn.Sequential, eqx.combine(self._unravel(params), self._static))

    def values_of_each(self, params: Params, observations: FloatArray) -> NDArray[Any]:
        """Q(s,·) of any number of observations, [N, D] to [N, A].

        Each row depends only on its own observation, to the last bit.

        Raises:
            UserError: this process was forked after JAX had started.
        """
        device.start()

        def values_of(block: FloatArray) -> NDArray[Any]:
            return np.asarray(cast(jax.Array, self.values(params, block)))

        return in_blocks(values_of, observations)

    def policy(self, params: FloatArray) -> GreedyPolicy:
        """The greedy policy of these parameters [P]."""
        return GreedyPolicy(self, jnp.asarray(params))

    def describe(self) -> dict[str, Any]:
        """The network's config, under its key in a file of weights."""
        return {"network": asdict(self.config)}

    def layers(self, params: Params | FloatArray) -> dict[str, FloatArray]:
        """Parameters by name; see `Layout`."""
        return self.layout.split(np.asarray(params))

    def params_of(self, layers: Mapping[str, FloatArray]) -> NDArray[np.float32]:
        """Flat parameters from named ones; the inverse of `layers`.

        Raises:
            ValueError: the names, shapes or types are not those of this network.
        """
        return self.layout.join(layers)


def _split(module: eqx.Module) -> tuple[Any, Any]:
    """A module's arrays, and the rest of the module."""
    return cast(tuple[Any, Any], eqx.partition(module, eqx.is_array))


def make_network(config: NetworkConfig, spaces: Spaces) -> QNetwork:
    """The Q-network that a config describes, for an environment's sizes."""
    return QNetwork(spaces.observation_size, spaces.num_actions, config)
