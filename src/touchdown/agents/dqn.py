"""Deep Q-learning put together from parts: act, remember, update after every observation."""

from collections.abc import Mapping
from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PRNGKeyArray

from touchdown.agents.agent import Tensors
from touchdown.agents.batch import Params
from touchdown.agents.exploration import EpsilonGreedy
from touchdown.agents.learners import fused
from touchdown.agents.learners.fused import FusedNetwork
from touchdown.agents.learners.jax import (
    Batch,
    LearnerState,
    Metrics,
    Updated,
    Weights,
    copy_target,
    init_learner,
    make_update,
    state_from,
    tensors_of,
)
from touchdown.agents.networks import QNetwork
from touchdown.config.config import Config
from touchdown.config.sections import Backend, NetworkConfig, ReplayConfig
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, IntArray, Spaces, StepResult
from touchdown.replay.n_step import NStep
from touchdown.replay.replay import Proportional, Replay

# What noise is for. Large, as JAX folds a small number in as it splits that part off, and the
# first weights' keys are split off the same seed.
_LEARNING, _LOOKING, _ACTING = 1_000_001, 1_000_002, 1_000_003


def make_network(config: NetworkConfig, spaces: Spaces, backend: Backend = "jax") -> QNetwork:
    """The Q-network that the config describes for a world.

    Raises:
        UserError: the fused kernel is asked for and was not built.
    """
    kind = FusedNetwork if backend == "fused" else QNetwork
    return kind(spaces.observation_size, spaces.num_actions, config)


def make_state(network: QNetwork, config: Config) -> LearnerState:
    """A fresh learner's state, in the memory of the backend that the network is computed by."""
    state = init_learner(network, config.learning, config.seed)
    return fused.own(state) if isinstance(network, FusedNetwork) else state


class NoiseSource(NamedTuple):
    """What samples of noisy weights follow from: kept as plain numbers, as calls to JAX are slow.

    The number goes through checkpoints, so that a restored agent draws what it would have drawn.
    """

    seed: np.uint32
    number: int | jax.Array

    def key(self, purpose: int) -> PRNGKeyArray:
        """The key of one sample (inside a compiled function)."""
        of_purpose = jax.random.fold_in(jax.random.key(self.seed), purpose)
        return jax.random.fold_in(of_purpose, self.number)


def _proportional(config: ReplayConfig) -> Proportional | None:
    if not config.prioritized:
        return None
    return Proportional(config.alpha, config.beta, config.beta_duration)


class DQNAgent:
    """Algorithm 2 with the paper's target network and preferential memory, each by its own field.

    Args:
        config: all settings.
        spaces: the world's sizes.
        streams: the run's generators.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams) -> None:
        self._config = config
        self._streams = streams
        self.model = make_network(config.network, spaces, config.learning.backend)
        self.state = make_state(self.model, config)
        self.memory = Replay(
            config.replay.capacity,
            spaces.observation_size,
            config.replay.resaves,
            config.replay.resave_threshold,
            _proportional(config.replay),
        )
        learning = config.learning
        self._n_steps = [
            NStep(learning.n_step, learning.gamma, waits=learning.target == "sarsa")
            for _ in range(config.training.num_envs)
        ]
        self.observations = 0
        self.updates = 0
        self._explorer = EpsilonGreedy(config.exploration, spaces.num_actions, streams.exploration)
        self._next_q: jax.Array | None = None  # [N, A] for the coming actions, if known already
        self._values = self._compile_values()
        if isinstance(self.model, FusedNetwork):
            self._learn = self._fused_learning(self.model)
        else:
            self._learn = self._compile_learning()

    def _noise(self, number: int) -> NoiseSource | None:
        config = self._config
        return NoiseSource(np.uint32(config.seed), number) if config.network.noisy else None

    def _compile_values(self) -> Any:
        network = self.model
        if not network.config.noisy:
            return network.values

        def noisy_values(params: Params, observations: jax.Array, source: NoiseSource) -> jax.Array:
            return network.apply(params, observations, source.key(_ACTING))

        return jax.jit(noisy_values)

    def _compile_learning(self) -> Any:
        update = make_update(self.model, self._config.learning)

        def learn_and_look(
            state: LearnerState,
            batches: Float[jax.Array, "K B W"],
            weights: Float[jax.Array, "K B"] | None,
            observations: Float[jax.Array, "N D"],
            measured: bool,
            source: NoiseSource | None,
        ) -> tuple[Updated, Float[jax.Array, "N A"]]:
            def learn(
                state: LearnerState, drawn: tuple[Batch, Weights | None, jax.Array]
            ) -> tuple[LearnerState, tuple[Metrics | None, jax.Array]]:
                batch, weights, ahead = drawn
                noise = None
                if source is not None:
                    noise = NoiseSource(source.seed, source.number + ahead).key(_LEARNING)
                updated = update(state, batch, weights, measured, noise)
                return updated.state, (updated.metrics, updated.td_error)

            count = len(batches)
            state, (metrics, td_error) = jax.lax.scan(
                learn, state, (batches, weights, jnp.arange(count)), unroll=count == 1
            )
            if metrics is not None:
                metrics = Metrics(*(values[-1] for values in metrics))
            # the values for the next actions come from the same call: a second one would cost
            # as much again as the arithmetic of a small network
            noise = None if source is None else source.key(_LOOKING)
            q = self.model.apply(state.online_params, observations, noise)
            return Updated(state, metrics, td_error), q

        return jax.jit(learn_and_look, donate_argnums=0, static_argnums=4)

    def _fused_learning(self, network: FusedNetwork) -> Any:
        learn = fused.make_learn(network, self._config.learning)

        def learn_and_look(
            state: LearnerState,
            batches: FloatArray,
            weights: FloatArray | None,
            observations: FloatArray,
            measured: bool,
            _source: NoiseSource | None,
        ) -> tuple[Updated, FloatArray]:
            updated = learn(state, batches, weights)
            q = network.values(state.online_params, observations)
            return (updated if measured else updated._replace(metrics=None)), q

        return learn_and_look

    @property
    def epsilon(self) -> float:
        """Probability of a random action."""
        return self._explorer.epsilon

    def begin_episode(self, ended: int) -> None:
        """Set ε, where its schedule counts episodes."""
        self._explorer.begin_episode(ended, self.observations)

    def act(self, observations: FloatArray) -> IntArray:
        """ε-greedy actions (Algorithm 2, line 4), by noisy weights where the network has them.

        [N, D] to [N].
        """
        return self._explorer.act(len(observations), lambda: self._q_of(observations))

    def _q_of(self, observations: FloatArray) -> FloatArray:
        q = self._next_q
        if q is None:
            noise = self._noise(self.observations)
            q = cast(jax.Array, self._values(self.state.online_params, observations, noise))
        return np.asarray(q)

    def observe(
        self, o_tm1: FloatArray, a_tm1: IntArray, steps: StepResult, following: FloatArray
    ) -> dict[str, float] | None:
        """Remember transitions and learn from minibatches (Algorithm 2, lines 6-12).

        Returns:
            Metrics whenever another `metrics_period` updates are done, None at other times. Values
            are in units of the reward, whatever it is scaled by.
        """
        self._remember(o_tm1, a_tm1, steps)
        before, self.observations = self.observations, self.observations + len(a_tm1)
        self._next_q = None
        learning = self._config.learning
        due = self.observations // learning.update_period - before // learning.update_period
        metrics = None
        if due and len(self.memory) >= self._config.replay.min_size:
            metrics = self._update(due * learning.gradient_steps, following)
        period = learning.target_period
        if period and self.observations // period != before // period:
            self.state = copy_target(self.state)
        self._explorer.observed(self.observations)
        return metrics

    def _remember(self, o_tm1: FloatArray, a_tm1: IntArray, steps: StepResult) -> None:
        actions, rewards = a_tm1.tolist(), steps.rewards.tolist()
        terminated, truncated = steps.terminated.tolist(), steps.truncated.tolist()
        for index, n_step in enumerate(self._n_steps):
            o_t = steps.observations[index]
            # truncation still bootstraps
            whole = n_step.push(
                o_tm1[index], actions[index], rewards[index], o_t, terminated=terminated[index]
            )
            if truncated[index] and not terminated[index]:
                whole += n_step.cut(self._after(o_t))
            for transition in whole:
                self.memory.add(transition)

    def _after(self, observation: FloatArray) -> int:
        """The action that would come after a flight was cut off, for a target that asks for it."""
        if self._config.learning.target != "sarsa":
            return 0
        self._next_q = None
        return int(self.act(observation[None])[0])

    def _update(self, count: int, following: FloatArray) -> dict[str, float] | None:
        batch_size = self._config.learning.batch_size
        drawn = [self.memory.sample(batch_size, self._streams.replay) for _ in range(count)]
        words = np.stack([sample.records for sample in drawn])
        words = words.view(np.float32).reshape(count, batch_size, -1)
        weights = None
        if drawn[0].weights is not None:
            weights = np.stack([cast(FloatArray, sample.weights) for sample in drawn])
        before, self.updates = self.updates, self.updates + count
        period = self._config.training.metrics_period
        measured = self.updates // period != before // period
        noise = self._noise(before)
        updated, self._next_q = self._learn(self.state, words, weights, following, measured, noise)
        self.state, metrics, td_errors = updated
        if weights is not None:
            errors: FloatArray = np.asarray(td_errors)
            for sample, td_error in zip(drawn, errors, strict=True):
                self.memory.learnt(sample.indices, td_error)
        if metrics is None:
            return None
        shares = self.memory.shares()
        return {
            **metrics.to_floats(self._config.learning.reward_scale),
            "rewarded_share": shares.rewarded,
            "terminal_share": shares.terminal,
        }

    def recall(
        self, index: int, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray
    ) -> None:
        """Go once more through a step that was observed before a checkpoint.

        Whatever transitions are whole by it are in the memory already.
        """
        self._n_steps[index].push(o_tm1, a_tm1, r_t, o_t, terminated=False)

    def params(self) -> FloatArray:
        """The online network's parameters, [P]: a copy, for learning goes on."""
        return np.array(self.state.online_params)

    def tensors(self) -> dict[str, Tensors]:
        """The learner's state, the memory, and what is known for the coming actions."""
        acting = {} if self._next_q is None else {"next_q": np.array(self._next_q)}
        return {
            "learner": tensors_of(self.state),
            "memory": self.memory.tensors(),
            "acting": acting,
        }

    def facts(self) -> dict[str, Any]:
        """Counts and ε."""
        return {
            "observations": self.observations,
            "updates": self.updates,
            "epsilon": self.epsilon,
            "memory_added": self.memory.ring.added,
        }

    def restore(self, tensors: Mapping[str, Tensors], facts: Mapping[str, Any]) -> None:
        """Go on from a checkpoint.

        Raises:
            KeyError: something is missing.
            TypeError: something is of another kind.
            ValueError: something does not fit.
        """
        self.state = state_from(self.state, tensors["learner"])
        self.memory.restore(tensors["memory"], facts["memory_added"])
        next_q = tensors["acting"].get("next_q")
        self._next_q = None if next_q is None else jnp.array(next_q)
        self.observations, self.updates = facts["observations"], facts["updates"]
        self._explorer.epsilon = float(facts["epsilon"])
