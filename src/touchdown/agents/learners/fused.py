"""The learner that computes values and updates with a fused C++ kernel on the CPU.

Its slow twins are the JAX functions in `update`: the same arithmetic apart from rounding.
"""

from collections.abc import Mapping
from functools import cached_property, partial
from typing import Any, NamedTuple, cast

import jax
import numpy as np
from numpy.typing import NDArray

from touchdown.agents.learners.backend import is_built
from touchdown.agents.learners.learner import FitResult, UpdateResult
from touchdown.agents.learners.state import (
    LearnerState,
    Metrics,
    StateOwner,
    init_state,
)
from touchdown.agents.networks import GreedyPolicy, QNetwork
from touchdown.agents.rollout import Rollout, rollout_targets
from touchdown.config.config import Config
from touchdown.config.sections import LearningConfig
from touchdown.core import installation
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray, Tensors

Floats = NDArray[np.float32]


class FusedNetwork:
    """A Q-network with values from the fused kernel and the parameters of a `QNetwork`.

    Args:
        network: the same network in JAX.

    Raises:
        UserError: the kernel was not built.
    """

    def __init__(self, network: QNetwork) -> None:
        if not is_built():
            raise UserError(
                "backend = 'fused': the kernel was not built with touchdown; use backend = 'jax', "
                f"or {installation.how_to_compile()}"
            )
        from touchdown.agents.learners._fused import Perceptron  # noqa: PLC0415 - if it was built

        self.network = network
        self.perceptron = Perceptron(
            network.observation_size,
            network.config.hidden_sizes,
            network.num_actions,
            layer_norm=network.config.layer_norm,
            dueling=network.config.dueling,
            quantiles=network.config.quantiles,
            atoms=network.config.atoms,
            v_min=network.config.v_min,
            v_max=network.config.v_max,
        )

    def values_of_each(self, params: Any, observations: Any) -> Any:
        """Q(s,·) of any number of observations, [N, D] to [N, A].

        Each row depends only on its own observation, to the last bit.
        """
        observations = np.ascontiguousarray(observations, np.float32)
        q = np.empty((len(observations), self.network.num_actions), np.float32)
        self.perceptron.values(np.asarray(params), observations, q)
        return q

    def layers(self, params: FloatArray) -> Mapping[str, Any]:
        """The parameters by name, as in `QNetwork.layers`."""
        return self.network.layers(params)

    def params_of(self, layers: Tensors) -> FloatArray:
        """Flat parameters from named ones, as in `QNetwork.params_of`."""
        return self.network.params_of(layers)

    def policy(self, params: FloatArray) -> GreedyPolicy:
        """The greedy policy of these parameters [P], computed by the kernel."""
        return GreedyPolicy(self, params)

    def describe(self) -> dict[str, Any]:
        """The network's config, as in `QNetwork.describe`: weights do not depend on the backend."""
        return self.network.describe()


class FusedLearner(StateOwner):
    """Updates a network with the fused kernel, which writes to the state in place.

    Args:
        network: the network to train.
        config: all settings, limited to what the kernel supports (`config.rules` refuses the rest).

    Raises:
        UserError: the kernel was not built.
    """

    def __init__(self, network: QNetwork, config: Config) -> None:
        self.model = FusedNetwork(network)
        super().__init__(numpy_state(init_state(network, config.learning, config.seed)))
        self._config = config

    def values(self, observations: FloatArray, env_steps: int) -> FloatArray:
        """Q(s,·) for choosing actions: [N, D] to [N, A]."""
        del env_steps  # the kernel's networks never have noisy weights
        return self.model.values_of_each(self.state.online_params, observations)

    def update(
        self,
        packed: Floats,
        weights: Floats | None,
        next_observations: FloatArray,
        updates: int,
        *,
        measured: bool,
    ) -> UpdateResult:
        """Update the parameters with K minibatches, one after the other."""
        del updates
        config, adam = self._config.learning, adam_of(self.state)
        td_error = np.empty(packed.shape[:2], np.float32)
        metrics = self.model.perceptron.learn(
            cast(Any, self.state.online_params),
            cast(Any, self.state.target_params),
            adam.mu,
            adam.nu,
            adam.updates,
            step_sizes(config, adam.updates, len(packed)),
            packed,
            weights,
            td_error,
            huber=config.loss == "huber",
            double_q=config.double,
            sarsa=config.target == "sarsa",
            reward_scale=config.reward_scale,
            max_grad_norm=config.max_grad_norm,
            polyak=config.polyak,
        )
        adam.advance(len(packed))
        next_q = self.model.values_of_each(self.state.online_params, next_observations)
        return UpdateResult(metrics_of(metrics) if measured else None, td_error, next_q)

    def fit_rollout(
        self, rollout: Rollout, order: NDArray[np.int64], next_observations: FloatArray
    ) -> FitResult:
        """Fit Q(s,a) to the λ-returns of a rollout with K minibatches, one after the other."""
        o_tm1, o_t = (part.reshape(-1, part.shape[2]) for part in (rollout.o_tm1, rollout.o_t))
        q_t = self.model.values_of_each(self.state.online_params, o_t)
        targets = cast(Floats, np.asarray(self._targets(rollout, q_t)))
        metrics = self.fit(
            cast(Any, o_tm1), cast(Any, rollout.a_tm1.ravel()), targets.ravel(), order
        )
        next_q = self.model.values_of_each(self.state.online_params, next_observations)
        return FitResult(metrics, next_q)

    def fit(
        self,
        o_tm1: Floats,
        a_tm1: NDArray[np.int32],
        targets: Floats,
        order: NDArray[np.int64],
    ) -> Metrics:
        """Fit Q(s,a) to given targets with K minibatches, one after the other.

        Args:
            o_tm1: observations, [M, D].
            a_tm1: actions, [M].
            targets: targets of Q(s,a), [M].
            order: indices of the entries in each minibatch, [K, B].

        Returns:
            Metrics of the last update.
        """
        config, adam = self._config.learning, adam_of(self.state)
        metrics = self.model.perceptron.fit(
            cast(Any, self.state.online_params),
            adam.mu,
            adam.nu,
            adam.updates,
            step_sizes(config, adam.updates, len(order)),
            o_tm1,
            a_tm1,
            targets,
            order,
            np.empty(order.shape, np.float32),
            huber=config.loss == "huber",
            max_grad_norm=config.max_grad_norm,
        )
        adam.advance(len(order))
        return metrics_of(metrics)

    @cached_property
    def _targets(self) -> Any:
        return jax.jit(partial(rollout_targets, config=self._config))


def numpy_state(state: LearnerState) -> LearnerState:
    """A copy of a learner's state in arrays that the kernel can write to."""
    return cast(LearnerState, jax.tree.map(np.array, state))


class Adam(NamedTuple):
    """Adam's arrays inside the optimiser state, which the kernel writes to."""

    mu: Floats
    nu: Floats
    counts: list[NDArray[np.int32]]
    """The update counts, one for each transformation in the chain that has one."""

    @property
    def updates(self) -> int:
        """Updates so far."""
        return int(self.counts[0])

    def advance(self, updates: int) -> None:
        """Count more updates."""
        for count in self.counts:
            count[...] += updates


def adam_of(state: LearnerState) -> Adam:
    """The arrays of Adam in a learner's state."""
    leaves = cast(list[tuple[Any, Any]], jax.tree.leaves_with_path(state.opt_state))
    named = [(path[-1].name, leaf) for path, leaf in leaves]
    (mu,) = (leaf for name, leaf in named if name == "mu")
    (nu,) = (leaf for name, leaf in named if name == "nu")
    return Adam(mu, nu, [leaf for name, leaf in named if name == "count"])


def step_sizes(config: LearningConfig, first: int, count: int) -> Floats:
    """Learning rates of `count` updates from number `first` on, [K], as in `make_optimizer`."""
    if not config.learning_rate_duration:
        return np.full(count, config.learning_rate, np.float32)
    left = 1 - np.minimum(first + np.arange(count), config.learning_rate_duration) / (
        config.learning_rate_duration
    )
    fall = config.learning_rate - config.learning_rate_end
    return (config.learning_rate_end + fall * left).astype(np.float32)


def metrics_of(values: tuple[float, float, float, float]) -> Metrics:
    """The metrics that the kernel returned: loss, mean Q, greatest Q, gradient norm."""
    return Metrics(*(cast(Any, value) for value in values))
