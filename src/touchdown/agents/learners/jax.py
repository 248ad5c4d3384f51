"""The learner in JAX: any network, any device, all updates of a step in one compiled call."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from touchdown.agents import td
from touchdown.agents.batch import Params
from touchdown.agents.learners.learner import FitResult, Metrics, UpdateResult
from touchdown.agents.learners.losses import LossFunction
from touchdown.agents.learners.noise import NoiseSource
from touchdown.agents.learners.purposes import ACTING, NEXT_VALUES, UPDATES
from touchdown.agents.learners.state import (
    LearnerState,
    copy_target,
    init_state,
    state_from,
    tensors_of,
)
from touchdown.agents.learners.update import Packed, Updated, Weights, make_fit, make_update
from touchdown.agents.networks import QNetwork
from touchdown.agents.rollout import Rollout
from touchdown.config.config import Config
from touchdown.core.types import FloatArray, Tensors


class JaxLearner:
    """Updates a network with JAX gradients and optax optimisers.

    Args:
        network: the network to train, available as `model`.
        config: all settings.
        losses: of a minibatch; None takes those of the config, which depend on the network's
            outputs. The rewards that it is given are scaled by `reward_scale`.
    """

    def __init__(
        self, network: QNetwork, config: Config, losses: LossFunction | None = None
    ) -> None:
        self.model = network
        self._losses = losses
        self.state = init_state(network, config.learning, config.seed)
        self._config = config

    def values(self, observations: FloatArray, env_steps: int) -> FloatArray:
        """Q(s,·) for choosing actions: [N, D] to [N, A]; with noisy weights if there are any."""
        return np.asarray(
            self._values(self.state.online_params, observations, self._noise(env_steps))
        )

    def update(
        self,
        packed: NDArray[np.float32],
        weights: NDArray[np.float32] | None,
        next_observations: FloatArray,
        updates: int,
        *,
        measured: bool,
    ) -> UpdateResult:
        """Update the parameters with K minibatches, one after the other."""
        noise = self._noise(updates)
        updated, next_q = self._update(
            self.state, packed, weights, next_observations, measured, noise
        )
        self.state, metrics, td_error = updated
        return UpdateResult(metrics, td_error, next_q)

    def fit_rollout(
        self, rollout: Rollout, order: NDArray[np.int64], next_observations: FloatArray
    ) -> FitResult:
        """Fit Q(s,a) to the λ-returns of a rollout with K minibatches, one after the other."""
        # JAX may read its arguments after this call returns, when the caller overwrites them
        copied = Rollout(*(jnp.array(part) for part in rollout))
        self.state, metrics, next_q = self._fit(self.state, copied, order, next_observations)
        return FitResult(metrics, next_q)

    def copy_target(self) -> None:
        """Θ′ ← Θ (Eq. 5)."""
        self.state = copy_target(self.state)

    def tensors(self) -> Tensors:
        """All arrays of the state by name, for a checkpoint."""
        return tensors_of(self.state)

    def restore(self, tensors: Mapping[str, NDArray[Any]]) -> None:
        """Restore the state that `tensors` returned.

        Raises:
            ValueError: the names, shapes or types are not those of this learner.
        """
        self.state = state_from(self.state, tensors)

    def _noise(self, number: int) -> NoiseSource | None:
        config = self._config
        return NoiseSource(np.uint32(config.seed), number) if config.network.noisy else None

    @cached_property
    def _values(self) -> Any:
        network = self.model
        if not network.config.noisy:
            return network.values

        def noisy_values(params: Params, observations: jax.Array, source: NoiseSource) -> jax.Array:
            return network.apply(params, observations, source.key(ACTING))

        return jax.jit(noisy_values)

    @cached_property
    def _update(self) -> Any:
        """All updates of a step and the values of the next observations, compiled into one call."""
        update = make_update(self.model, self._config.learning, self._losses)

        def update_and_next_values(
            state: LearnerState,
            minibatches: Float[jax.Array, "K B W"],
            weights: Float[jax.Array, "K B"] | None,
            next_observations: Float[jax.Array, "N D"],
            measured: bool,
            source: NoiseSource | None,
        ) -> tuple[Updated, Float[jax.Array, "N A"]]:
            def update_once(
                state: LearnerState, drawn: tuple[Packed, Weights | None, jax.Array]
            ) -> tuple[LearnerState, tuple[Metrics | None, jax.Array]]:
                packed, weights, ahead = drawn
                key = None
                if source is not None:
                    key = NoiseSource(source.seed, source.number + ahead).key(UPDATES)
                updated = update(state, packed, weights, measured, key)
                return updated.state, (updated.metrics, updated.td_error)

            count = len(minibatches)
            state, (metrics, td_error) = jax.lax.scan(
                update_once, state, (minibatches, weights, jnp.arange(count)), unroll=count == 1
            )
            if metrics is not None:
                metrics = Metrics(*(values[-1] for values in metrics))
            key = None if source is None else source.key(NEXT_VALUES)
            next_q = self.model.apply(state.online_params, next_observations, key)
            return Updated(state, metrics, td_error), next_q

        return jax.jit(update_and_next_values, donate_argnums=0, static_argnums=4)

    @cached_property
    def _fit(self) -> Any:
        """λ-returns, all updates and the values of the next observations, in one compiled call."""
        network, config = self.model, self._config
        fit = make_fit(network, config.learning)

        def fit_and_next_values(
            state: LearnerState,
            rollout: Rollout,
            order: Int[jax.Array, "K B"],
            next_observations: Float[jax.Array, "N D"],
        ) -> tuple[LearnerState, Metrics, Float[jax.Array, "N A"]]:
            q_t = network.apply(state.online_params, rollout.o_t.reshape(-1, rollout.o_t.shape[2]))
            reward = rollout.r_t * config.learning.reward_scale
            discount = config.learning.gamma * (1 - rollout.terminated)
            best = q_t.max(axis=-1).reshape(reward.shape)
            returns = td.lambda_returns(
                reward, discount, best, rollout.truncated, config.rollout.trace_decay
            )
            flat = (
                rollout.o_tm1.reshape(-1, rollout.o_tm1.shape[2]),
                rollout.a_tm1.ravel(),
                returns.ravel(),
            )

            def fit_once(
                state: LearnerState, chosen: Int[jax.Array, " B"]
            ) -> tuple[LearnerState, Metrics]:
                return fit(state, *(part[chosen] for part in flat))

            state, metrics = jax.lax.scan(fit_once, state, order)
            last = Metrics(*(values[-1] for values in metrics))
            return state, last, network.apply(state.online_params, next_observations)

        return cast(Any, jax.jit(fit_and_next_values, donate_argnums=0))
