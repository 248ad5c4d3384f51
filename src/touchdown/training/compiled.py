"""The training loop of DQN in C++: many steps of agent and environments in one call.

Its slow twin is `loop.interact` with a `DQNAgent`: both give the same bytes. The C++ code writes to
the arrays of the Python objects and draws from their random generators, so that between two steps
of the iterator every object is as the Python loop would have left it.
"""

from collections.abc import Callable, Iterator

import numpy as np

from touchdown.agents.dqn import DQNAgent
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.envs.episodes import Underway
from touchdown.envs.pool import ExactEnvPool
from touchdown.lander import rules
from touchdown.replay.n_step import Windows
from touchdown.training.arrays import episode_arrays, pool_arrays
from touchdown.training.compiled_steps import MetricsTuple, Shared, settings_of
from touchdown.training.loop import AgentStep

# settings that have one name in a config and in C++, by section
_SETTINGS = {
    "replay": (
        *("min_size", "resaves", "resave_threshold"),
        *("prioritized", "alpha", "beta", "beta_duration"),
    ),
    "learning": (
        *("gamma", "n_step", "batch_size"),
        *("learning_rate", "learning_rate_end", "learning_rate_duration"),
        *("reward_scale", "max_grad_norm", "update_period", "gradient_steps", "target_period"),
        *("polyak", "averaging", "double", "bootstrap_on_time_limit"),
    ),
}


class CompiledLoop:
    """DQN with the fused kernel in landers of the exact engine.

    Args:
        agent: acts and learns; its learner is a `FusedLearner`.
        pool: the environments.
        streams: the agent's random generators.
        config: the agent's settings, which `runs.loop.why_python` has nothing against.
    """

    def __init__(
        self, agent: DQNAgent, pool: ExactEnvPool, streams: Streams, config: Config
    ) -> None:
        self._agent, self._pool = agent, pool
        self._shared = Shared(agent, pool, streams)
        settings = settings_of(config, _SETTINGS)
        self._loop = self._shared.make(self._shared.module.Loop, settings)
        learning = config.learning
        self._waits = learning.n_step > 1 or learning.target == "sarsa"
        """Whether a step can be stored only after a later one."""
        self._windows = Windows.empty(len(pool.actions), learning.n_step, rules.OBSERVATION_SIZE)

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
        ring, shared, counts = self._agent.replay.ring, self._shared, self._shared.counts
        counts.added = ring.added
        if self._waits:
            self._windows.read(self._agent.n_steps)
        priorities = self._agent.replay.priorities
        if priorities is not None:
            counts.max_priority = priorities.max_priority
            counts.num_batches = priorities.num_batches
        with shared.lent():
            metrics = self._loop.advance(
                max_steps,
                counts,
                pool_arrays(self._pool),
                episode_arrays(underway),
                shared.module.WindowArrays(*self._windows),
                ring.storage.view(np.float32).reshape(ring.capacity, -1),
                None if priorities is None else priorities.nodes,
                shared.learner_arrays(),
                shared.next_q,
            )
        if priorities is not None:
            priorities.max_priority = counts.max_priority
            priorities.num_batches = counts.num_batches
        if self._waits:
            self._windows.write(self._agent.n_steps, underway.observations)
        ring.wrote(counts.added - ring.added)
        return metrics
