"""A Q-network whose values the fused C++ kernel computes on the CPU, without JAX."""

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.greedy import GreedyPolicy
from touchdown.agents.layout import Layout
from touchdown.agents.learners.backend import is_built
from touchdown.config.sections import NetworkConfig
from touchdown.core import installation
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray, Tensors


class FusedNetwork:
    """A multilayer perceptron as functions of one flat parameter vector, as `QNetwork` is.

    Args:
        observation_size: D, inputs.
        num_actions: A, outputs.
        config: layers and head, limited to what the kernel supports.

    Raises:
        UserError: the kernel was not built.
    """

    def __init__(self, observation_size: int, num_actions: int, config: NetworkConfig) -> None:
        if not is_built():
            raise UserError(
                "backend = 'fused': the kernel was not built with touchdown; use backend = 'jax', "
                f"or {installation.how_to_compile()}"
            )
        from touchdown.agents.learners._fused import Perceptron  # noqa: PLC0415 - if it was built

        self.layout = Layout(observation_size, num_actions, config)
        self.num_actions = num_actions
        self.config = config
        self.perceptron = Perceptron(
            observation_size,
            config.hidden_sizes,
            num_actions,
            layer_norm=config.layer_norm,
            dueling=config.dueling,
            quantiles=config.quantiles,
            atoms=config.atoms,
            v_min=config.v_min,
            v_max=config.v_max,
            noisy=config.noisy,
        )

    def values_of_each(
        self,
        params: FloatArray,
        observations: FloatArray,
        noise: tuple[int, int, int] | None = None,
    ) -> NDArray[np.float32]:
        """Q(s,·) of any number of observations, [N, D] to [N, A].

        Each row depends only on its own observation, to the last bit.

        Args:
            params: flat parameters, [P].
            observations: [N, D].
            noise: seed, purpose and number of a sample of noisy weights; None uses their means.
        """
        observations = np.ascontiguousarray(observations, np.float32)
        q = np.empty((len(observations), self.num_actions), np.float32)
        self.perceptron.values(np.asarray(params, np.float32), observations, q, noise)
        return q

    def layers(self, params: FloatArray) -> dict[str, FloatArray]:
        """The parameters by name; see `Layout`."""
        return self.layout.split(params)

    def params_of(self, layers: Tensors) -> NDArray[np.float32]:
        """Flat parameters from named ones; the inverse of `layers`.

        Raises:
            ValueError: the names, shapes or types are not those of this network.
        """
        return self.layout.join(layers)

    def policy(self, params: FloatArray) -> GreedyPolicy:
        """The greedy policy of these parameters [P], computed by the kernel."""
        return GreedyPolicy(self, params)

    def describe(self) -> dict[str, Any]:
        """The network's config, as in `QNetwork.describe`: weights do not depend on the backend."""
        return {"network": asdict(self.config)}
