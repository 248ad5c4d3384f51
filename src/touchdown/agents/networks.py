"""Q-networks: observations in, one value an action out."""

from typing import Any, cast

import equinox as eqx
import jax
from jax.flatten_util import ravel_pytree
from jaxtyping import Float, PRNGKeyArray

from touchdown.types import Params

_ACTIVATIONS = {"relu": jax.nn.relu, "tanh": jax.nn.tanh, "silu": jax.nn.silu}


class QNetwork:
    """A multilayer perceptron as functions of one flat vector of parameters.

    Args:
        observation_size: D, inputs.
        num_actions: A, outputs.
        hidden_sizes: nodes of each hidden layer; none makes Q linear in the observation.
        activation: `relu`, `tanh` or `silu`, after each hidden layer.
    """

    def __init__(
        self,
        observation_size: int,
        num_actions: int,
        hidden_sizes: tuple[int, ...],
        activation: str = "relu",
    ) -> None:
        self.observation_size = observation_size
        self._sizes = (observation_size, *hidden_sizes, num_actions)
        self._activation = _ACTIVATIONS[activation]
        arrays, self._static = _split(self._module(jax.random.key(0)))
        flat, self._unravel = ravel_pytree(arrays)
        self.num_params = int(flat.size)
        self.values = jax.jit(self.apply)
        """`apply`, compiled once for everyone who flies this network."""

    def _module(self, key: PRNGKeyArray) -> eqx.nn.Sequential:
        keys = jax.random.split(key, len(self._sizes) - 1)
        layers: list[Any] = []
        for fan_in, fan_out, layer_key in zip(self._sizes, self._sizes[1:], keys, strict=False):
            layers.append(eqx.nn.Linear(fan_in, fan_out, key=layer_key))
            layers.append(eqx.nn.Lambda(self._activation))
        return eqx.nn.Sequential(layers[:-1])

    def init(self, key: PRNGKeyArray) -> Params:
        """Fresh parameters: weights and biases uniform in ±1/√(fan in)."""
        return ravel_pytree(_split(self._module(key))[0])[0]

    def apply(
        self, params: Params, observations: Float[jax.Array, "B D"]
    ) -> Float[jax.Array, "B A"]:
        """Q(s,·) of each observation."""
        module = cast(eqx.nn.Sequential, eqx.combine(self._unravel(params), self._static))
        return jax.vmap(module)(observations)

    def layers(self, params: Params) -> dict[str, jax.Array]:
        """Parameters by name: `layers.0.weight` [out, in], `layers.0.bias` [out], and so on."""
        linears = self._unravel(params).layers[::2]
        return {
            f"layers.{i}.{name}": getattr(linear, name)
            for i, linear in enumerate(linears)
            for name in ("weight", "bias")
        }


def _split(module: eqx.Module) -> tuple[Any, Any]:
    """A module's arrays, and the rest of it."""
    return cast(tuple[Any, Any], eqx.partition(module, eqx.is_array))
