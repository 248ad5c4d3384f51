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
from touchdown.training.compiled_steps import MetricsTuple, Shared, settings_of
from touchdown.training.loop import AgentStep

# settings that have one name in a config and in C++, by section
_SETTINGS = {
    "learning": (
        *("gamma", "learning_rate", "learning_rate_end", "learning_rate_duration"),
        *("reward_scale", "max_grad_norm", "averaging", "bootstrap_on_time_limit"),
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
        self._agent, self._pool = agent, pool
        self._shared = Shared(agent, pool, streams)
        settings = settings_of(config, _SETTINGS)
        self._loop = self._shared.make(self._shared.module.PqnLoop, settings)

    def interact(self, start_of: Callable[[int], int], underway: Underway) -> Iterator[AgentStep]:
        """The steps of `loop.interact`, of which only some are yielded; see `Shared.steps`.

        Args:
            start_of: the environment seed of an episode, by its number.
            underway: the current episode in each environment, updated before each step is yielded.
        """
        return self._shared.steps(
            start_of, underway, lambda max_steps: self._advance(max_steps, underway)
        )

    def _advance(self, max_steps: int, underway: Underway) -> MetricsTuple | None:
        """Take steps in C++, from and to the state that the Python objects have."""
        agent, shared = self._agent, self._shared
        shared.counts.filled = agent.num_filled
        with shared.lent():
            metrics = self._loop.advance(
                max_steps,
                shared.counts,
                pool_arrays(self._pool),
                episode_arrays(underway),
                shared.module.RolloutArrays(*agent.rollout),
                shared.learner_arrays(),
                shared.next_q,
            )
        agent.num_filled = shared.counts.filled
        return metrics
