"""The parameters of a Q-network by name, and where they are in its flat parameter vector."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from math import prod

import numpy as np
from numpy.typing import NDArray

from touchdown.config.sections import NetworkConfig
from touchdown.core.types import FloatArray


class Layout:
    """Names and shapes of a Q-network's parameters, in the order of the flat vector.

    `layers.0.weight` is [out, in], `layers.0.bias` [out], and so on. Normalisation layers add
    `norms.0.weight`, a dueling head `value.weight` and `advantage.weight`, noisy weights
    `layers.0.weight_sigma` and `layers.0.bias_sigma`.

    Args:
        observation_size: D, inputs.
        num_actions: A, outputs.
        config: layers and head.

    Attributes:
        shapes: the shape of each parameter, by its name.
        num_params: P.
    """

    def __init__(self, observation_size: int, num_actions: int, config: NetworkConfig) -> None:
        self.observation_size = observation_size
        self.num_actions = num_actions
        self.config = config
        self.shapes = dict(self._named())
        self.num_params = sum(map(prod, self.shapes.values()))

    def _named(self) -> Iterator[tuple[str, tuple[int, ...]]]:
        config = self.config
        sizes = (self.observation_size, *config.hidden_sizes)
        for number, (fan_in, fan_out) in enumerate(pairwise(sizes)):
            yield from self._linear(f"layers.{number}", fan_in, fan_out)
            if config.layer_norm:
                yield from ((f"norms.{number}.{kind}", (fan_out,)) for kind in ("weight", "bias"))
        outputs = max(1, config.quantiles, config.atoms)
        if config.dueling:
            yield from self._linear("value", sizes[-1], outputs)
            yield from self._linear("advantage", sizes[-1], self.num_actions * outputs)
        else:
            last = f"layers.{len(config.hidden_sizes)}"
            yield from self._linear(last, sizes[-1], self.num_actions * outputs)

    def _linear(
        self, name: str, fan_in: int, fan_out: int
    ) -> Iterator[tuple[str, tuple[int, ...]]]:
        for suffix in ("", "_sigma") if self.config.noisy else ("",):
            yield f"{name}.weight{suffix}", (fan_out, fan_in)
            yield f"{name}.bias{suffix}", (fan_out,)

    def split(self, params: FloatArray) -> dict[str, FloatArray]:
        """Views of flat parameters [P] by name."""
        ends = np.cumsum([prod(shape) for shape in self.shapes.values()])
        parts = np.split(params, ends[:-1])
        named = zip(self.shapes.items(), parts, strict=True)
        return {name: part.reshape(shape) for (name, shape), part in named}

    def join(self, layers: Mapping[str, FloatArray]) -> NDArray[np.float32]:
        """Flat parameters from named ones, [P]; the inverse of `split`.

        Raises:
            ValueError: the names, shapes or types are not those of this network.
        """
        if layers.keys() != self.shapes.keys():
            raise ValueError(f"it has {sorted(layers)}, must be {sorted(self.shapes)}")
        for name, shape in self.shapes.items():
            given = layers[name]
            if given.shape != shape or given.dtype != np.float32:
                raise ValueError(f"{name} is {given.dtype}{given.shape}, must be float32{shape}")
        return np.concatenate([layers[name].ravel() for name in self.shapes])
