"""The fused kernel behind the interfaces of the JAX functions that are its slow twins."""

import importlib.util
from collections.abc import Callable
from typing import Any, NamedTuple, cast

import jax
import numpy as np
from numpy.typing import NDArray

from touchdown.agents.learners.jax import LearnerState, Metrics, Updated
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import LearningConfig, NetworkConfig
from touchdown.core.errors import UserError

Floats = NDArray[np.float32]


def is_built() -> bool:
    """Whether the package was installed where there was a C++ compiler."""
    return importlib.util.find_spec("touchdown.agents.learners._fused") is not None


class FusedNetwork(QNetwork):
    """A Q-network whose values and updates are computed by the fused kernel, on the CPU.

    Its parameters are those of the `QNetwork` with the same config, in the same order.

    Args:
        observation_size: D, inputs.
        num_actions: A, outputs.
        config: layers and head.

    Raises:
        UserError: the kernel was not built.
    """

    def __init__(self, observation_size: int, num_actions: int, config: NetworkConfig) -> None:
        super().__init__(observation_size, num_actions, config)
        if not is_built():
            raise UserError(
                "backend = 'fused': was not built, as there was no C++ compiler; install one, such "
                "as g++, and touchdown again, or take backend = 'jax'"
            )
        # where it was not built there is nothing to import
        from touchdown.agents.learners._fused import Perceptron  # noqa: PLC0415

        self.perceptron = Perceptron(
            observation_size,
            config.hidden_sizes,
            num_actions,
            layer_norm=config.layer_norm,
            dueling=config.dueling,
        )
        self.values = self._values

    def _values(self, params: Any, observations: Any, _noise: None = None) -> Any:
        """As the slow twin's, which takes noise too: no network of this kind has any."""
        return self.values_of_each(params, observations)

    def values_of_each(self, params: Any, observations: Any) -> Any:
        """Q(s,·) of any number of observations, [N, D] to [N, A]: of each as it would be alone."""
        observations = np.ascontiguousarray(observations, np.float32)
        q = np.empty((len(observations), self.num_actions), np.float32)
        self.perceptron.values(np.asarray(params), observations, q)
        return q


def own(state: LearnerState) -> LearnerState:
    """A copy of a learner's state in memory that the kernel may write to."""
    return cast(LearnerState, jax.tree.map(np.array, state))


class _Adam(NamedTuple):
    """Adam's arrays inside an optimiser's state, to be written to."""

    mu: Floats
    nu: Floats
    counts: list[NDArray[np.int32]]
    """Updates done, as often as the chain of transformations counts them."""

    @property
    def updates(self) -> int:
        return int(self.counts[0])

    def advance(self, updates: int) -> None:
        for count in self.counts:
            count[...] += updates


def _adam_of(state: LearnerState) -> _Adam:
    leaves = cast(list[tuple[Any, Any]], jax.tree.leaves_with_path(state.opt_state))
    named = [(path[-1].name, leaf) for path, leaf in leaves]
    (mu,) = (leaf for name, leaf in named if name == "mu")
    (nu,) = (leaf for name, leaf in named if name == "nu")
    return _Adam(mu, nu, [leaf for name, leaf in named if name == "count"])


def _rates(config: LearningConfig, first: int, count: int) -> Floats:
    """Step sizes of some updates in a row, [K] (as `learner.make_optimizer`'s schedule)."""
    if not config.learning_rate_duration:
        return np.full(count, config.learning_rate, np.float32)
    left = 1 - np.minimum(first + np.arange(count), config.learning_rate_duration) / (
        config.learning_rate_duration
    )
    fall = config.learning_rate - config.learning_rate_end
    return (config.learning_rate_end + fall * left).astype(np.float32)


def make_learn(
    network: FusedNetwork, config: LearningConfig
) -> Callable[[LearnerState, Floats, Floats | None], Updated]:
    """K updates of `learner.make_update` in one call.

    Returns:
        A function of a state of `own`, which is written to, of records [K, B, W] and of their
        weights [K, B]. Gives that state, metrics of the last update, and TD errors [K, B].
    """

    def learn(state: LearnerState, words: Floats, weights: Floats | None) -> Updated:
        adam = _adam_of(state)
        td_error = np.empty(words.shape[:2], np.float32)
        metrics = network.perceptron.learn(
            cast(Any, state.online_params),
            cast(Any, state.target_params),
            adam.mu,
            adam.nu,
            adam.updates,
            _rates(config, adam.updates, len(words)),
            words,
            weights,
            td_error,
            huber=config.loss == "huber",
            double_q=config.double,
            sarsa=config.target == "sarsa",
            reward_scale=config.reward_scale,
            max_grad_norm=config.max_grad_norm,
            polyak=config.polyak,
        )
        adam.advance(len(words))
        return Updated(state, _metrics(metrics), cast(Any, td_error))

    return learn


def make_fit(
    network: FusedNetwork, config: LearningConfig
) -> Callable[
    [LearnerState, Floats, NDArray[np.int32], Floats, NDArray[np.int64]],
    tuple[LearnerState, Metrics],
]:
    """K updates of `learner.make_fit` in one call.

    Returns:
        A function of a state of `own`, which is written to, of observations [M, D], actions [M]
        and targets [M], and of which of them each update takes, [K, B]. Gives that state and
        metrics of the last update.
    """

    def fit(
        state: LearnerState,
        o_tm1: Floats,
        a_tm1: NDArray[np.int32],
        target: Floats,
        order: NDArray[np.int64],
    ) -> tuple[LearnerState, Metrics]:
        adam = _adam_of(state)
        metrics = network.perceptron.fit(
            cast(Any, state.online_params),
            adam.mu,
            adam.nu,
            adam.updates,
            _rates(config, adam.updates, len(order)),
            o_tm1,
            a_tm1,
            target,
            order,
            np.empty(order.shape, np.float32),
            huber=config.loss == "huber",
            max_grad_norm=config.max_grad_norm,
        )
        adam.advance(len(order))
        return state, _metrics(metrics)

    return fit


def _metrics(values: tuple[float, float, float, float]) -> Metrics:
    return Metrics(*(cast(Any, value) for value in values))
