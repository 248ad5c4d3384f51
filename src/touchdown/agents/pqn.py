"""PQN: Q-learning without a memory or a target network, from many worlds at once.

Gallici et al., 2025: λ-returns over a short rollout of all worlds, a few rounds of minibatches, and
layer normalisation, which keeps the bootstrapping stable in place of a target network.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from touchdown.agents import td
from touchdown.agents.agent import Tensors
from touchdown.agents.dqn import make_network, make_state
from touchdown.agents.exploration import EpsilonGreedy
from touchdown.agents.learners import fused
from touchdown.agents.learners.fused import FusedNetwork
from touchdown.agents.learners.jax import LearnerState, Metrics, make_fit, state_from, tensors_of
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, IntArray, Spaces, StepResult


class Rollout(NamedTuple):
    """T steps of N worlds."""

    o_tm1: Float[jax.Array, "T N D"]
    a_tm1: Int[jax.Array, "T N"]
    r_t: Float[jax.Array, "T N"]
    o_t: Float[jax.Array, "T N D"]
    terminated: Float[jax.Array, "T N"]
    """1 where the world ended, else 0."""
    truncated: Float[jax.Array, "T N"]
    """1 where an episode was cut off, else 0."""


class PQNAgent:
    """Learns from rollouts of many worlds as soon as they are whole.

    Args:
        config: all settings; its algorithm is `pqn`.
        spaces: the world's sizes.
        streams: the run's generators.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams) -> None:
        self._config = config
        self._streams = streams
        self.model = make_network(config.network, spaces, config.learning.backend)
        self.state = make_state(self.model, config)
        shape = config.rollout.rollout_steps, config.training.num_envs
        wide = *shape, spaces.observation_size
        # written to step by step, and handed to JAX when it is whole
        self._kept: dict[str, NDArray[Any]] = {
            name: np.zeros(wide if name in ("o_tm1", "o_t") else shape, np.float32)
            for name in Rollout._fields
        }
        self._kept["a_tm1"] = np.zeros(shape, np.int32)
        self._filled = 0  # steps of the rollout that are there
        self.observations = 0
        self.updates = 0
        self._explorer = EpsilonGreedy(config.exploration, spaces.num_actions, streams.exploration)
        self._next_q: jax.Array | None = None
        if isinstance(self.model, FusedNetwork):
            self._learn = self._fused(self.model)
        else:
            self._learn = self._compile()

    def _compile(self) -> Any:
        network = self.model
        fit = make_fit(network, self._config.learning)

        def learn_and_look(
            state: LearnerState,
            rollout: Rollout,
            order: Int[jax.Array, "K B"],
            observations: Float[jax.Array, "N D"],
        ) -> tuple[LearnerState, Metrics, Float[jax.Array, "N A"]]:
            q_t = network.apply(state.online_params, rollout.o_t.reshape(-1, rollout.o_t.shape[2]))
            returns = self._targets(rollout, q_t)
            flat = (
                rollout.o_tm1.reshape(-1, rollout.o_tm1.shape[2]),
                rollout.a_tm1.ravel(),
                returns.ravel(),
            )

            def learn(
                state: LearnerState, chosen: Int[jax.Array, " B"]
            ) -> tuple[LearnerState, Metrics]:
                return fit(state, *(part[chosen] for part in flat))

            state, metrics = jax.lax.scan(learn, state, order)
            last = Metrics(*(values[-1] for values in metrics))
            return state, last, network.apply(state.online_params, observations)

        compiled = cast(Any, jax.jit(learn_and_look, donate_argnums=0))

        def copied(state: LearnerState, rollout: Rollout, *others: Any) -> Any:
            # JAX may read its arguments later than this call, and steps are written over them
            return compiled(state, Rollout(*(jnp.array(part) for part in rollout)), *others)

        return copied

    def _targets(self, rollout: Rollout, q_t: Float[jax.Array, "TN A"]) -> Float[jax.Array, "T N"]:
        """λ-returns of a rollout, from the action values of the observations after its steps."""
        config = self._config
        best = q_t.max(axis=-1).reshape(rollout.r_t.shape)
        reward = rollout.r_t * config.learning.reward_scale
        discount = config.learning.gamma * (1 - rollout.terminated)
        decay = config.rollout.trace_decay
        return td.lambda_returns(reward, discount, best, rollout.truncated, decay)

    def _fused(self, network: FusedNetwork) -> Any:
        fit = fused.make_fit(network, self._config.learning)
        targets = cast(Any, jax.jit(self._targets))

        def learn_and_look(
            state: LearnerState,
            rollout: Any,  # of NumPy's arrays
            order: NDArray[np.int64],
            observations: FloatArray,
        ) -> tuple[LearnerState, Metrics, FloatArray]:
            o_tm1, o_t = (part.reshape(-1, part.shape[2]) for part in (rollout.o_tm1, rollout.o_t))
            q_t = network.values(state.online_params, o_t)
            returns = cast(NDArray[np.float32], np.asarray(targets(rollout, q_t)))
            state, metrics = fit(state, o_tm1, rollout.a_tm1.ravel(), returns.ravel(), order)
            return state, metrics, network.values(state.online_params, observations)

        return learn_and_look

    @property
    def epsilon(self) -> float:
        """Probability of a random action."""
        return self._explorer.epsilon

    def begin_episode(self, ended: int) -> None:
        """Set ε, where its schedule counts episodes."""
        self._explorer.begin_episode(ended, self.observations)

    def act(self, observations: FloatArray) -> IntArray:
        """ε-greedy actions: [N, D] to [N]."""
        return self._explorer.act(len(observations), lambda: self._q_of(observations))

    def _q_of(self, observations: FloatArray) -> FloatArray:
        q = self._next_q
        if q is None:
            q = cast(jax.Array, self.model.values(self.state.online_params, observations))
        return np.asarray(q)

    def observe(
        self, o_tm1: FloatArray, a_tm1: IntArray, steps: StepResult, following: FloatArray
    ) -> dict[str, float] | None:
        """Keep one step, and learn where it makes the rollout whole.

        Returns:
            Metrics whenever another `metrics_period` updates are done.
        """
        cut = steps.truncated & ~steps.terminated
        step = (o_tm1, a_tm1, steps.rewards, steps.observations, steps.terminated, cut)
        for kept, value in zip(self._kept.values(), step, strict=True):
            kept[self._filled] = value
        self._filled += 1
        self._next_q = None
        self.observations += len(a_tm1)
        metrics = None
        if self._filled == self._config.rollout.rollout_steps:
            metrics = self._update(following)
        self._explorer.observed(self.observations)
        return metrics

    def _update(self, following: FloatArray) -> dict[str, float] | None:
        config = self._config.rollout
        self._filled = 0
        size = self._kept["r_t"].size
        orders = [
            self._streams.replay.permutation(size)[: size - size % config.minibatches]
            for _ in range(config.epochs)
        ]
        order = np.concatenate(orders).reshape(config.epochs * config.minibatches, -1)
        rollout = Rollout(**cast(Any, self._kept))
        self.state, metrics, self._next_q = self._learn(self.state, rollout, order, following)
        before, self.updates = self.updates, self.updates + len(order)
        period = self._config.training.metrics_period
        if self.updates // period == before // period:
            return None
        return metrics.to_floats(self._config.learning.reward_scale)

    def recall(
        self, index: int, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray
    ) -> None:
        """Go once more through a step before a checkpoint: the rollout is in the checkpoint."""

    def params(self) -> FloatArray:
        """The network's parameters, [P]: a copy."""
        return np.array(self.state.online_params)

    def tensors(self) -> dict[str, Tensors]:
        """The learner's state, the rollout, and what is known for the coming actions."""
        acting = {} if self._next_q is None else {"next_q": np.array(self._next_q)}
        return {"learner": tensors_of(self.state), "rollout": self._kept, "acting": acting}

    def facts(self) -> dict[str, Any]:
        """Counts and ε."""
        return {
            "observations": self.observations,
            "updates": self.updates,
            "epsilon": self.epsilon,
            "filled": self._filled,
        }

    def restore(self, tensors: Mapping[str, Tensors], facts: Mapping[str, Any]) -> None:
        """Go on from a checkpoint.

        Raises:
            KeyError: something is missing.
            TypeError: something is of another kind.
            ValueError: something does not fit.
        """
        self.state = state_from(self.state, tensors["learner"])
        for name, part in self._kept.items():
            part[:] = tensors["rollout"][name]
        next_q = tensors["acting"].get("next_q")
        self._next_q = None if next_q is None else jnp.array(next_q)
        if facts["filled"] >= self._config.rollout.rollout_steps:
            raise ValueError(f"agent.filled = {facts['filled']}: more than a rollout's steps")
        self.observations, self.updates = facts["observations"], facts["updates"]
        self._explorer.epsilon, self._filled = float(facts["epsilon"]), int(facts["filled"])
