"""Q-networks: observations in, one value an action out."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Float, PRNGKeyArray
from numpy.typing import NDArray

from touchdown.config import NetworkConfig
from touchdown.types import FloatArray, IntArray, Params

_ROWS = 32  # observations in one call of a greedy pilot
_KINDS = ("weight", "bias")
_ACTIVATIONS = {"relu": jax.nn.relu, "tanh": jax.nn.tanh, "silu": jax.nn.silu}


class DuelingHead(eqx.Module):
    """Q(s,a) = V(s) + A(s,a) − mean A(s,·)   (Wang et al., 2016, Eq. 9)."""

    value: eqx.nn.Linear
    advantage: eqx.nn.Linear

    num_actions: int = eqx.field(static=True)

    def __init__(
        self, fan_in: int, num_actions: int, outputs: int = 1, *, key: PRNGKeyArray
    ) -> None:
        value_key, advantage_key = jax.random.split(key)
        self.num_actions = num_actions
        self.value = eqx.nn.Linear(fan_in, outputs, key=value_key)
        self.advantage = eqx.nn.Linear(fan_in, num_actions * outputs, key=advantage_key)

    def __call__(
        self, features: Float[jax.Array, " F"], *, key: PRNGKeyArray | None = None
    ) -> Float[jax.Array, " AZ"]:
        """Q(s,·) of one state's features; of several outputs an action, each on its own."""
        del key
        advantage = self.advantage(features).reshape(self.num_actions, -1)
        q = self.value(features) + advantage - advantage.mean(axis=0)
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
        arrays, self._static = _split(self._module(jax.random.key(0)))
        flat, self._unravel = ravel_pytree(arrays)
        self.num_params = int(flat.size)
        self.values = jax.jit(self.apply)
        """`apply`, compiled once for everyone who flies this network."""

    def _module(self, key: PRNGKeyArray) -> eqx.nn.Sequential:
        config = self.config
        sizes = (self.observation_size, *config.hidden_sizes)
        *keys, head_key = jax.random.split(key, len(sizes))
        layers: list[Any] = []
        for fan_in, fan_out, layer_key in zip(sizes, sizes[1:], keys, strict=False):
            layers.append(eqx.nn.Linear(fan_in, fan_out, key=layer_key))
            if config.layer_norm:
                layers.append(eqx.nn.LayerNorm(fan_out))
            layers.append(eqx.nn.Lambda(_ACTIVATIONS[config.activation]))
        outputs = max(1, config.quantiles)
        if config.dueling:
            layers.append(DuelingHead(sizes[-1], self.num_actions, outputs, key=head_key))
        else:
            layers.append(eqx.nn.Linear(sizes[-1], self.num_actions * outputs, key=head_key))
        return eqx.nn.Sequential(layers)

    def init(self, key: PRNGKeyArray) -> Params:
        """Fresh parameters: weights and biases uniform in ±1/√(fan in)."""
        return ravel_pytree(_split(self._module(key))[0])[0]

    def apply(
        self, params: Params, observations: Float[jax.Array, "B D"]
    ) -> Float[jax.Array, "B A"]:
        """Q(s,·) of each observation."""
        outputs = self._outputs(params, observations)
        return self._by_action(outputs).mean(axis=-1) if self.config.quantiles else outputs

    def quantiles(
        self, params: Params, observations: Float[jax.Array, "B D"]
    ) -> Float[jax.Array, "B A Z"]:
        """Quantiles of the return of each action, for a network that has them."""
        return self._by_action(self._outputs(params, observations))

    def _by_action(self, outputs: Float[jax.Array, "B AZ"]) -> Float[jax.Array, "B A Z"]:
        return outputs.reshape(len(outputs), self.num_actions, -1)

    def _outputs(self, params: Params, observations: Float[jax.Array, "B D"]) -> jax.Array:
        module = cast(eqx.nn.Sequential, eqx.combine(self._unravel(params), self._static))
        return jax.vmap(module)(observations)

    def pilot(self, params: FloatArray) -> "GreedyPilot":
        """Flies these parameters [P] without exploring."""
        return GreedyPilot(self, params)

    def describe(self) -> dict[str, Any]:
        """The network's config, by the key that a file of weights has it under."""
        return {"network": asdict(self.config)}

    def layers(self, params: Params | FloatArray) -> dict[str, jax.Array]:
        """Parameters by name: `layers.0.weight` [out, in], `layers.0.bias` [out], and so on.

        Of a normalisation `norms.0.weight`; of a dueling head `value.weight`, `advantage.weight`.
        """
        leaves = jax.tree.leaves(self._unravel(jnp.asarray(params)))
        return dict(zip(self._names(), leaves, strict=True))

    def params_of(self, layers: Mapping[str, FloatArray]) -> NDArray[np.float32]:
        """Flat parameters from those that `layers` names.

        Raises:
            ValueError: they are others than this network's, or of other shapes or types.
        """
        wanted = self.layers(jax.numpy.zeros(self.num_params))
        if layers.keys() != wanted.keys():
            raise ValueError(f"it holds {sorted(layers)}, the network needs {sorted(wanted)}")
        for name, like in wanted.items():
            given = layers[name]
            if given.shape != like.shape or given.dtype != np.float32:
                raise ValueError(
                    f"{name} is {given.dtype}{given.shape}, must be float32{like.shape}"
                )
        return np.concatenate([layers[name].ravel() for name in wanted])

    def _names(self) -> list[str]:
        """The parameters' names in the order in which they lie in the flat vector."""
        arrays = self._unravel(jax.numpy.zeros(self.num_params))
        counts: dict[str, int] = {}
        names: list[str] = []
        for layer in arrays.layers:
            if isinstance(layer, DuelingHead):
                names += [f"{part}.{kind}" for part in ("value", "advantage") for kind in _KINDS]
            elif isinstance(layer, eqx.nn.Linear | eqx.nn.LayerNorm):
                group = "layers" if isinstance(layer, eqx.nn.Linear) else "norms"
                number = counts[group] = counts.get(group, -1) + 1
                names += [f"{group}.{number}.{kind}" for kind in _KINDS]
        return names


class GreedyPilot:
    """Flies a trained network without exploring.

    Args:
        network: the shape.
        params: its flat parameters, [P].
    """

    def __init__(self, network: QNetwork, params: FloatArray) -> None:
        self._params = jnp.asarray(params)
        self._values = network.values

    def act(self, observations: FloatArray) -> IntArray:
        """The best action of each observation: [N, D] to [N].

        Calls always have the same shape: one compilation serves all, and an action does not depend
        on how many observations came along (another shape may round another way).
        """
        actions: list[IntArray] = []
        for first in range(0, len(observations), _ROWS):
            rows = observations[first : first + _ROWS]
            padded = np.zeros((_ROWS, rows.shape[1]), np.float32)
            padded[: len(rows)] = rows
            q = cast(jax.Array, self._values(self._params, padded))
            actions.append(np.asarray(q)[: len(rows)].argmax(axis=1))
        return np.concatenate(actions)


def _split(module: eqx.Module) -> tuple[Any, Any]:
    """A module's arrays, and the rest of it."""
    return cast(tuple[Any, Any], eqx.partition(module, eqx.is_array))
