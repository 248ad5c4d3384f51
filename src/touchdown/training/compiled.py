"""The training loop of DQN in C++: many steps of agent and environments in one call.

Its slow twin is `loop.interact` with a `DQNAgent`: both give the same bytes. The C++ code writes to
the arrays of the Python objects and draws from their random generators, so that between two steps
of the iterator every object is as the Python loop would have left it.
"""

from collections.abc import Callable, Iterator

import numpy as np

from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.learners.learner import Metrics
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.envs.episodes import Underway
from touchdown.envs.pool import ExactEnvPool
from touchdown.lander import rules
from touchdown.replay.n_step import Windows
from touchdown.training.arrays import episode_arrays, pool_arrays
from touchdown.training.loop import STEPS_BETWEEN_LOOKS, AgentStep, begin_next

MetricsTuple = tuple[float, float, float, float]

# settings that have one name in a config and in C++, by section
_SETTINGS = {
    "exploration": (
        *("schedule", "epsilon_start", "epsilon_end", "epsilon_decay", "epsilon_duration"),
    ),
    "replay": (
        *("min_size", "resaves", "resave_threshold"),
        *("prioritized", "alpha", "beta", "beta_duration"),
    ),
    "learning": (
        *(
            "gamma",
            "n_step",
            "learning_rate",
            "learning_rate_end",
            "learning_rate_duration",
            "batch_size",
        ),
        *("reward_scale", "max_grad_norm", "update_period", "gradient_steps", "target_period"),
        *("polyak", "averaging", "double"),
    ),
    "training": ("metrics_period",),
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
        from touchdown.training import _train  # noqa: PLC0415 - if it was built

        if not isinstance(agent.learner, FusedLearner):
            raise TypeError(f"the compiled loop needs a FusedLearner, got {agent.learner!r}")
        settings = _train.Settings()
        for section, names in _SETTINGS.items():
            for name in names:
                setattr(settings, name, getattr(getattr(config, section), name))
        settings.huber = config.learning.loss == "huber"
        settings.max_episode_steps = rules.MAX_EPISODE_STEPS
        self._agent, self._learner, self._pool = agent, agent.learner, pool
        bit_generators = (streams.exploration.bit_generator, streams.replay.bit_generator)
        self._locks = [each.lock for each in bit_generators]
        self._loop = _train.Loop(
            pool.batch,
            *bit_generators,
            settings,
            agent.learner.model.perceptron.network,
            agent.mirror,
        )
        self._module = _train
        self._counts = _train.Counts()
        self._windows = Windows.empty(
            len(pool.actions), config.learning.n_step, rules.OBSERVATION_SIZE
        )
        self._next_q = np.zeros((len(pool.actions), rules.NUM_ACTIONS), np.float32)

    def interact(self, start_of: Callable[[int], int], underway: Underway) -> Iterator[AgentStep]:
        """The steps of `loop.interact`, of which only some are yielded, endless.

        Those are the steps that ended an episode or completed a metrics period, and those after
        which the episode of environment 0 has a multiple of `STEPS_BETWEEN_LOOKS` steps.

        Args:
            start_of: the environment seed of an episode, by its number.
            underway: the current episode in each environment, updated before each step is yielded.
        """
        agent, pool = self._agent, self._pool
        every_env = np.arange(len(pool.actions))
        while True:
            before = agent.env_steps
            left = STEPS_BETWEEN_LOOKS - int(underway.steps[0]) % STEPS_BETWEEN_LOOKS
            metrics = self._advance(left, underway)
            actions, result = pool.actions.copy(), pool.results(every_env)
            ended = begin_next(pool, start_of, underway, result)
            if ended:
                metrics = self._advance(0, underway)
            yield AgentStep(
                actions,
                result,
                self._counts.epsilon_used,
                ended,
                None if metrics is None else agent.measured(Metrics(*metrics)),
                (agent.env_steps - before) // len(actions),
            )

    def _advance(self, max_steps: int, underway: Underway) -> MetricsTuple | None:
        """Take steps in C++, from and to the state that the Python objects have."""
        actor, ring, counts = self._agent.actor, self._agent.replay.ring, self._counts
        state, pool, arrays = self._learner.state, self._pool, self._module
        counts.env_steps, counts.episodes, counts.updates = (
            actor.env_steps,
            actor.episodes,
            actor.updates,
        )
        counts.adam_updates, counts.added = state.updates, ring.added
        counts.epsilon = actor.epsilon
        counts.knows_values = actor.next_q is not None
        if actor.next_q is not None:
            self._next_q[...] = actor.next_q
        several = self._windows.a_tm1.shape[1] > 1  # otherwise no step waits for another
        if several:
            self._windows.read(self._agent.n_steps)
        priorities = self._agent.replay.priorities
        if priorities is not None:
            counts.max_priority = priorities.max_priority
            counts.num_batches = priorities.num_batches
        exploration_lock, replay_lock = self._locks
        with exploration_lock, replay_lock:
            metrics = self._loop.advance(
                max_steps,
                counts,
                pool_arrays(pool),
                episode_arrays(underway),
                arrays.WindowArrays(*self._windows),
                ring.storage.view(np.float32).reshape(ring.capacity, -1),
                None if priorities is None else priorities.nodes,
                arrays.LearnerArrays(
                    state.online_params,
                    state.target_params,
                    state.mu,
                    state.nu,
                    self._agent.average,
                ),
                self._next_q,
            )
        if priorities is not None:
            priorities.max_priority = counts.max_priority
            priorities.num_batches = counts.num_batches
        actor.count(env_steps=counts.env_steps, episodes=counts.episodes, updates=counts.updates)
        actor.next_q = self._next_q.copy() if counts.knows_values else None
        if several:
            self._windows.write(self._agent.n_steps, underway.observations)
        self._learner.state = state._replace(updates=counts.adam_updates)
        ring.wrote(counts.added - ring.added)
        return metrics
