"""Deep Q-learning put together from parts: act, remember, update after every observation."""

from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PRNGKeyArray
from numpy.typing import NDArray

from touchdown.agents import exploration
from touchdown.agents.learner import (
    Batch,
    LearnerState,
    Metrics,
    Updated,
    Weights,
    copy_target,
    init_learner,
    make_update,
)
from touchdown.agents.networks import QNetwork
from touchdown.config import Config, ReplayConfig
from touchdown.memory.n_step import NStep
from touchdown.memory.replay import Proportional, Replay
from touchdown.seeding import Streams
from touchdown.types import FloatArray, IntArray, Params

_ROWS = 32  # observations in one call of a greedy pilot
# What noise is for. Large, as JAX folds a small number in as it splits that part off, and the
# first weights' keys are split off the same seed.
_LEARNING, _ACTING = 1_000_001, 1_000_002


class Spaces(NamedTuple):
    """The sizes that a world gives an agent."""

    observation_size: int
    num_actions: int


def make_network(config: Config, spaces: Spaces) -> QNetwork:
    """The Q-network that the config describes for a world."""
    return QNetwork(spaces.observation_size, spaces.num_actions, config.network)


class NoiseSource(NamedTuple):
    """What a sample of noisy weights follows from: kept as plain numbers, as calls to JAX are slow.

    Its number goes through checkpoints, so that a restored agent draws what it would have drawn.
    """

    seed: np.uint32
    number: int

    def key(self, purpose: int) -> PRNGKeyArray:
        """The sample's key (inside a compiled function)."""
        of_purpose = jax.random.fold_in(jax.random.key(self.seed), purpose)
        return jax.random.fold_in(of_purpose, self.number)


def _proportional(config: ReplayConfig) -> Proportional | None:
    if not config.prioritized:
        return None
    return Proportional(config.alpha, config.beta, config.beta_duration)


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


class DQNAgent:
    """Algorithm 2 with the paper's target network and preferential memory, each by its own field.

    Args:
        config: all settings.
        spaces: the world's sizes.
        streams: the run's generators.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams) -> None:
        self._config = config
        self._spaces = spaces
        self._streams = streams
        self.network = make_network(config, spaces)
        self.state = init_learner(self.network, config.learning, config.seed)
        self.memory = Replay(
            config.replay.capacity,
            spaces.observation_size,
            config.replay.resaves,
            config.replay.resave_threshold,
            _proportional(config.replay),
        )
        self._n_step = NStep(config.learning.n_step, config.learning.gamma)
        self.observations = 0  # environment steps observed so far
        self.updates = 0
        self.epsilon = 1.0
        self._epsilon_of = exploration.make_schedule(config.exploration)
        self._next_q: jax.Array | None = None  # Q(s,·) for the coming action, if known already
        self._values = self._compile_values()
        self._update = self._compile_update()

    def _noise(self, number: int) -> NoiseSource | None:
        config = self._config
        return NoiseSource(np.uint32(config.seed), number) if config.network.noisy else None

    def _compile_values(self) -> Any:
        network = self.network
        if not network.config.noisy:
            return network.values

        def noisy_values(params: Params, observations: jax.Array, source: NoiseSource) -> jax.Array:
            return network.apply(params, observations, source.key(_ACTING))

        return jax.jit(noisy_values)

    def _compile_update(self) -> Any:
        update = make_update(self.network, self._config.learning)

        def update_and_look(
            state: LearnerState,
            batch: Batch,
            weights: Weights | None,
            observation: jax.Array,
            measured: bool,
            source: NoiseSource | None,
        ) -> tuple[Updated, jax.Array]:
            # the values for the next action come from the same call: a second one would cost
            # as much again as the arithmetic of a small network
            noise = None if source is None else source.key(_LEARNING)
            learning, acting = (None, None) if noise is None else jax.random.split(noise)
            updated = update(state, batch, weights, measured, learning)
            online = updated.state.online_params
            return updated, self.network.apply(online, observation[None], acting)[0]

        return jax.jit(update_and_look, donate_argnums=0, static_argnums=4)

    def begin_episode(self, episode: int) -> None:
        """Set ε for an episode whose schedule counts episodes, and forget the last one's values."""
        self._next_q = None
        self.epsilon = self._epsilon_of(episode, self.observations)

    def act(self, observation: FloatArray) -> int:
        """An ε-greedy action (Algorithm 2, line 4), by noisy weights where the network has them."""
        if exploration.explores(self.epsilon, self._streams.exploration):
            return int(self._streams.exploration.integers(self._spaces.num_actions))
        q = self._next_q
        if q is None:
            noise = self._noise(self.observations)
            q = cast(jax.Array, self._values(self.state.online_params, observation[None], noise)[0])
        return int(np.asarray(q).argmax())

    def observe(
        self,
        o_tm1: FloatArray,
        a_tm1: int,
        r_t: float,
        o_t: FloatArray,
        *,
        terminated: bool,
    ) -> Metrics | None:
        """Remember one transition and learn from a minibatch (Algorithm 2, lines 6-12).

        Returns:
            The metrics of every `metrics_period`-th update, None at other times.
        """
        config = self._config
        # truncation still bootstraps
        for experience in self._n_step.push(o_tm1, a_tm1, r_t, o_t, terminated=terminated):
            self.memory.add(experience)
        self.observations += 1
        self._next_q = None
        metrics = None
        if (
            len(self.memory) >= config.replay.min_size
            and self.observations % config.learning.update_period == 0
        ):
            sample = self.memory.sample(config.learning.batch_size, self._streams.replay)
            words = sample.records.view(np.float32).reshape(len(sample.records), -1)
            self.updates += 1
            measured = self.updates % config.training.metrics_period == 0
            updated, self._next_q = self._update(
                self.state, words, sample.weights, o_t, measured, self._noise(self.updates)
            )
            self.state, metrics, td_error = updated
            if sample.weights is not None:
                self.memory.learnt(sample.indices, np.asarray(td_error))
        period = config.learning.target_period
        if period and self.observations % period == 0:
            self.state = copy_target(self.state)
        if config.exploration.schedule == "linear":
            self.epsilon = self._epsilon_of(0, self.observations)
        return metrics

    def recall(self, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray) -> None:
        """Go once more through a step that was observed before a checkpoint and is no end.

        Whatever transitions are whole by it are in the memory already.
        """
        self._n_step.push(o_tm1, a_tm1, r_t, o_t, terminated=False)

    def mood(self) -> tuple[float, NDArray[np.float32] | None]:
        """ε, and Q(s,·) of where the episode is, if it is known: what `state` leaves out."""
        return self.epsilon, None if self._next_q is None else np.array(self._next_q)

    def restore_mood(self, epsilon: float, next_q: NDArray[np.float32] | None) -> None:
        """Go on in the middle of an episode."""
        self.epsilon = epsilon
        self._next_q = None if next_q is None else jnp.array(next_q)

    def cut(self) -> None:
        """The episode was cut off: remember what was under way."""
        for experience in self._n_step.cut():
            self.memory.add(experience)

    def pilot(self) -> GreedyPilot:
        """What has been learnt so far, as a pilot that goes on unchanged while learning goes on."""
        return GreedyPilot(self.network, np.array(self.state.online_params))
