"""The training loop of PQN in C++: many steps of agent and environments in one call.

Its slow twin is `loop.interact` with a `PQNAgent`: both give the same bytes, as with
`compiled.CompiledLoop`.
"""

from collections.abc import Callable, Iterator

from touchdown.agents.pqn import PQNAgent
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.envs.episodes import Underway
from touchdown.envs.pool import ExactEnvPool
from touchdown.training.arrays import episode_arrays, pool_arrays
from touchdown.training.compiled_steps import (
    MetricsTuple,
    SharedCounts,
    compiled_steps,
    fused_learner,
    settings_of,
)
from touchdown.training.loop import AgentStep

# settings that have one name in a config and in C++, by section
_SETTINGS = {
    "learning": (
        *("gamma", "learning_rate", "learning_rate_end", "learning_rate_duration"),
        *("reward_scale", "max_grad_norm", "averaging"),
    ),
    "rollout": ("rollout_steps", "epochs", "minibatches", "trace_decay"),
}


class CompiledPQN:
    """PQN with the fused kernel in landers of the exact engine.

    Args:
        agent: acts and learns; its learner is a `FusedLearner`.
        pool: the environments.
        streams: the agent's random generators.
        config: the agent's settings, which `runs.loop.why_python` has nothing against.
    """

    def __init__(
        self, agent: PQNAgent, pool: ExactEnvPool, streams: Streams, config: Config
    ) -> None:
        from touchdown.training import _train  # noqa: PLC0415 - if it was built

        self._agent, self._learner, self._pool = agent, fused_learner(agent), pool
        bit_generators = (streams.exploration.bit_generator, streams.replay.bit_generator)
        self._locks = [each.lock for each in bit_generators]
        self._loop = _train.PqnLoop(
            pool.batch,
            *bit_generators,
            settings_of(config, _SETTINGS),
            self._learner.model.perceptron.network,
            agent.mirror,
        )
        self._module = _train
        self._shared = SharedCounts(agent, len(pool.actions))

    def interact(self, start_of: Callable[[int], int], underway: Underway) -> Iterator[AgentStep]:
        """The steps of `loop.interact`, of which only some are yielded; see `compiled_steps`.

        Args:
            start_of: the environment seed of an episode, by its number.
            underway: the current episode in each environment, updated before each step is yielded.
        """
        return compiled_steps(
            self._agent,
            self._pool,
            start_of,
            underway,
            lambda max_steps: self._advance(max_steps, underway),
            self._shared.counts,
        )

    def _advance(self, max_steps: int, underway: Underway) -> MetricsTuple | None:
        """Take steps in C++, from and to the state that the Python objects have."""
        agent, shared, state, arrays = self._agent, self._shared, self._learner.state, self._module
        shared.read()
        shared.counts.filled = agent.num_filled
        exploration_lock, replay_lock = self._locks
        with exploration_lock, replay_lock:
            metrics = self._loop.advance(
                max_steps,
                shared.counts,
                pool_arrays(self._pool),
                episode_arrays(underway),
                arrays.RolloutArrays(*agent.rollout),
                arrays.LearnerArrays(state.online_params, None, state.mu, state.nu, agent.average),
                shared.next_q,
            )
        agent.num_filled = shared.counts.filled
        shared.write()
        return metrics
