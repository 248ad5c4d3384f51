"""The learner that computes values and updates with a fused C++ kernel on the CPU, without JAX.

Its slow twins are the JAX functions in `update`: the same arithmetic apart from rounding.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.initial import initial_params
from touchdown.agents.learners.fused_network import FusedNetwork
from touchdown.agents.learners.learner import FitResult, Metrics, UpdateResult, check_tensors
from touchdown.agents.learners.purposes import ACTING, NEXT_VALUES, UPDATES
from touchdown.agents.rollout import Rollout, rollout_targets
from touchdown.config.config import Config
from touchdown.config.sections import LearningConfig
from touchdown.core.types import FloatArray, Tensors

Floats = NDArray[np.float32]


class FusedState(NamedTuple):
    """Everything that an update reads and writes, in arrays that the kernel writes to in place."""

    online_params: Floats
    """[P], like all that follow."""
    target_params: Floats | None
    """None if there is no target network; the online network bootstraps then."""
    mu: Floats
    """Adam's mean of the gradient."""
    nu: Floats
    """Adam's mean of the squared gradient."""
    updates: int
    """Updates so far."""


class FusedLearner:
    """Updates a network with the fused kernel.

    Args:
        model: the network to train.
        config: all settings, limited to what the kernel supports (`config.rules` refuses the rest).
    """

    def __init__(self, model: FusedNetwork, config: Config) -> None:
        self.model = model
        online = initial_params(model.layout, config.seed)
        self.state = FusedState(
            online,
            online.copy() if config.learning.has_target else None,
            np.zeros_like(online),
            np.zeros_like(online),
            0,
        )
        self._config = config

    def values(self, observations: FloatArray, env_steps: int) -> FloatArray:
        """Q(s,·) for choosing actions: [N, D] to [N, A]."""
        noise = self._noise(ACTING, env_steps)
        return self.model.values_of_each(self.state.online_params, observations, noise)

    def _noise(self, purpose: int, number: int) -> tuple[int, int, int] | None:
        config = self._config
        return (config.seed, purpose, number) if config.network.noisy else None

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
        config, state = self._config.learning, self.state
        td_error = np.empty(packed.shape[:2], np.float32)
        metrics = self.model.perceptron.learn(
            state.online_params,
            state.target_params,
            state.mu,
            state.nu,
            state.updates,
            step_sizes(config, state.updates, len(packed)),
            packed,
            weights,
            td_error,
            huber=config.loss == "huber",
            double_q=config.double,
            sarsa=config.target == "sarsa",
            reward_scale=config.reward_scale,
            max_grad_norm=config.max_grad_norm,
            polyak=config.polyak,
            noise=self._noise(UPDATES, updates),
        )
        self.state = state._replace(updates=state.updates + len(packed))
        next_q = self.model.values_of_each(
            self.state.online_params, next_observations, self._noise(NEXT_VALUES, updates)
        )
        return UpdateResult(Metrics(*metrics) if measured else None, td_error, next_q)

    def fit_rollout(
        self, rollout: Rollout, order: NDArray[np.int64], next_observations: FloatArray
    ) -> FitResult:
        """Fit Q(s,a) to the λ-returns of a rollout with K minibatches, one after the other."""
        o_tm1, o_t = (part.reshape(-1, part.shape[2]) for part in (rollout.o_tm1, rollout.o_t))
        q_t = self.model.values_of_each(self.state.online_params, o_t)
        targets = rollout_targets(rollout, q_t, self._config)
        metrics = self.fit(o_tm1, rollout.a_tm1.ravel(), targets.ravel(), order)
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
        config, state = self._config.learning, self.state
        metrics = self.model.perceptron.fit(
            state.online_params,
            state.mu,
            state.nu,
            state.updates,
            step_sizes(config, state.updates, len(order)),
            o_tm1,
            a_tm1,
            targets,
            order,
            np.empty(order.shape, np.float32),
            huber=config.loss == "huber",
            max_grad_norm=config.max_grad_norm,
        )
        self.state = state._replace(updates=state.updates + len(order))
        return Metrics(*metrics)

    def copy_target(self) -> None:
        """Θ′ ← Θ (Eq. 5)."""
        self.state = self.state._replace(target_params=self.state.online_params.copy())

    def tensors(self) -> Tensors:
        """All arrays of the state by name, for a checkpoint; named as those of `JaxLearner`."""
        state = self.state
        named: dict[str, NDArray[Any]] = {"online_params": state.online_params.copy()}
        if state.target_params is not None:
            named["target_params"] = state.target_params.copy()
        # clipping is a link of optax's chain before Adam, a schedule counts in a link behind it
        adam = "opt_state[1]" if self._config.learning.max_grad_norm else "opt_state"
        updates = np.array(state.updates, np.int32)
        named |= {f"{adam}[0].count": updates, f"{adam}[0].mu": state.mu.copy()}
        named[f"{adam}[0].nu"] = state.nu.copy()
        if self._config.learning.learning_rate_duration:
            named[f"{adam}[1].count"] = updates
        return named

    def restore(self, tensors: Mapping[str, NDArray[Any]]) -> None:
        """Restore the state that `tensors` returned.

        Raises:
            ValueError: the names, shapes or types are not those of this learner.
        """
        check_tensors(tensors, self.tensors())
        part = {name.rpartition(".")[2]: value for name, value in tensors.items()}
        self.state = FusedState(
            part["online_params"].copy(),
            part["target_params"].copy() if "target_params" in part else None,
            part["mu"].copy(),
            part["nu"].copy(),
            int(part["count"]),
        )


def step_sizes(config: LearningConfig, first: int, count: int) -> Floats:
    """Learning rates of `count` updates from number `first` on, [K], as in `make_optimizer`."""
    if not config.learning_rate_duration:
        return np.full(count, config.learning_rate, np.float32)
    left = 1 - np.minimum(first + np.arange(count), config.learning_rate_duration) / (
        config.learning_rate_duration
    )
    fall = config.learning_rate - config.learning_rate_end
    return (config.learning_rate_end + fall * left).astype(np.float32)
