"""What the compiled loops share: their settings, counts and arrays, and the steps they yield."""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from touchdown.agents.learner_agent import LearnerAgent
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.learners.learner import Metrics
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.envs.episodes import Underway
from touchdown.envs.pool import ExactEnvPool
from touchdown.lander import rules
from touchdown.training.loop import STEPS_BETWEEN_LOOKS, AgentStep, begin_next

if TYPE_CHECKING:
    from touchdown.training import _train

MetricsTuple = tuple[float, float, float, float]
Loop = TypeVar("Loop")

_EXPLORATION = ("schedule", "epsilon_start", "epsilon_end", "epsilon_decay", "epsilon_duration")


def settings_of(config: Config, names: Mapping[str, Sequence[str]]) -> "_train.Settings":
    """The settings of a loop in C++.

    Args:
        config: all settings.
        names: settings that have one name in a config and in C++, by section; besides those that
            every loop has.
    """
    from touchdown.training import _train  # noqa: PLC0415 - if it was built

    settings = _train.Settings()
    every = {"exploration": _EXPLORATION, "training": ("metrics_period",)}
    for section, several in (*every.items(), *names.items()):
        for name in several:
            setattr(settings, name, getattr(getattr(config, section), name))
    settings.huber = config.learning.loss == "huber"
    settings.sarsa = config.learning.target == "sarsa"
    settings.max_episode_steps = rules.MAX_EPISODE_STEPS
    settings.seed = config.seed
    return settings


def _fused_learner(agent: LearnerAgent) -> FusedLearner:
    """The learner of an agent.

    Raises:
        TypeError: it is another learner than the compiled loops need.
    """
    if not isinstance(agent.learner, FusedLearner):
        raise TypeError(f"the compiled loop needs a FusedLearner, got {agent.learner!r}")
    return agent.learner


class Shared:
    """What Python's objects share with a loop in C++, for any algorithm.

    Args:
        agent: acts and learns; its learner is a `FusedLearner`.
        pool: the environments.
        streams: the agent's random generators.

    Raises:
        TypeError: the agent has another learner.
    """

    def __init__(self, agent: LearnerAgent, pool: ExactEnvPool, streams: Streams) -> None:
        from touchdown.training import _train  # noqa: PLC0415 - if it was built

        self.module = _train
        self.counts = _train.Counts()
        """The agent's counts, as C++ has them."""
        self.next_q = np.zeros((len(pool.actions), rules.NUM_ACTIONS), np.float32)
        """Its values for the next actions, [N, A]."""
        self._agent, self._learner, self._pool = agent, _fused_learner(agent), pool
        self._generators = streams.exploration.bit_generator, streams.replay.bit_generator

    def make(self, kind: Callable[..., Loop], settings: "_train.Settings") -> Loop:
        """A loop in C++ of these environments, generators and network.

        Args:
            kind: `_train.Loop` or `_train.PqnLoop`.
            settings: its settings.
        """
        network = self._learner.model.perceptron.network
        return kind(self._pool.batch, *self._generators, settings, network, self._agent.mirror)

    def learner_arrays(self) -> "_train.LearnerArrays":
        """The parameters and their moments, which C++ writes to."""
        state = self._learner.state
        return self.module.LearnerArrays(
            state.online_params, state.target_params, state.mu, state.nu, self._agent.average
        )

    @contextmanager
    def lent(self) -> Generator[None]:
        """Lend them, and the generators, to C++ while the block runs; take them back after it."""
        self._read()
        exploration, replay = self._generators
        with exploration.lock, replay.lock:
            yield
        self._write()

    def steps(
        self,
        start_of: Callable[[int], int],
        underway: Underway,
        advance: Callable[[int], MetricsTuple | None],
    ) -> Iterator[AgentStep]:
        """The steps of `loop.interact`, of which only some are yielded, endless.

        Those are the steps that ended an episode or completed a metrics period, and those after
        which the episode of environment 0 has a multiple of `STEPS_BETWEEN_LOOKS` steps.

        Args:
            start_of: the environment seed of an episode, by its number.
            underway: the current episode in each environment, updated before each step is yielded.
            advance: takes at most that many steps in C++; see `_train.Loop.advance`.
        """
        agent, pool = self._agent, self._pool
        every_env = np.arange(len(pool.actions))
        while True:
            before = agent.env_steps
            left = STEPS_BETWEEN_LOOKS - int(underway.steps[0]) % STEPS_BETWEEN_LOOKS
            metrics = advance(left)
            actions, result = pool.actions.copy(), pool.results(every_env)
            ended = begin_next(pool, start_of, underway, result)
            if ended:
                metrics = advance(0)
            yield AgentStep(
                actions,
                result,
                self.counts.epsilon_used,
                ended,
                None if metrics is None else agent.measured(Metrics(*metrics)),
                (agent.env_steps - before) // len(actions),
            )

    def _read(self) -> None:
        """Copy counts and values from the agent."""
        actor, counts = self._agent.actor, self.counts
        counts.env_steps, counts.episodes, counts.updates = (
            actor.env_steps,
            actor.episodes,
            actor.updates,
        )
        counts.adam_updates = self._learner.state.updates
        counts.epsilon = actor.epsilon
        counts.knows_values = actor.next_q is not None
        if actor.next_q is not None:
            self.next_q[...] = actor.next_q

    def _write(self) -> None:
        """Copy counts and values to the agent."""
        actor, counts = self._agent.actor, self.counts
        actor.count(env_steps=counts.env_steps, episodes=counts.episodes, updates=counts.updates)
        actor.next_q = self.next_q.copy() if counts.knows_values else None
        self._learner.state = self._learner.state._replace(updates=counts.adam_updates)
