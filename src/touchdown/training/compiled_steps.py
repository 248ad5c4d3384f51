"""What the compiled loops share: their settings and counts, and the steps that they yield."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from touchdown.agents.learner_agent import LearnerAgent
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.learners.learner import Metrics
from touchdown.config.config import Config
from touchdown.envs.episodes import Underway
from touchdown.envs.pool import ExactEnvPool
from touchdown.lander import rules
from touchdown.training.loop import STEPS_BETWEEN_LOOKS, AgentStep, begin_next

if TYPE_CHECKING:
    from touchdown.training import _train

MetricsTuple = tuple[float, float, float, float]

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


def fused_learner(agent: LearnerAgent) -> FusedLearner:
    """The learner of an agent.

    Raises:
        TypeError: it is another learner than the compiled loops need.
    """
    if not isinstance(agent.learner, FusedLearner):
        raise TypeError(f"the compiled loop needs a FusedLearner, got {agent.learner!r}")
    return agent.learner


class SharedCounts:
    """An agent's counts and its values for the next actions, as C++ has them.

    Args:
        agent: the agent.
        num_envs: N.
    """

    def __init__(self, agent: LearnerAgent, num_envs: int) -> None:
        from touchdown.training import _train  # noqa: PLC0415 - if it was built

        self._actor = agent.actor
        self._learner = fused_learner(agent)
        self.counts = _train.Counts()
        self.next_q = np.zeros((num_envs, rules.NUM_ACTIONS), np.float32)
        """[N, A]"""

    def read(self) -> None:
        """Copy them from the agent."""
        actor, counts = self._actor, self.counts
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

    def write(self) -> None:
        """Copy them to the agent."""
        actor, counts = self._actor, self.counts
        actor.count(env_steps=counts.env_steps, episodes=counts.episodes, updates=counts.updates)
        actor.next_q = self.next_q.copy() if counts.knows_values else None
        self._learner.state = self._learner.state._replace(updates=counts.adam_updates)


def compiled_steps(
    agent: LearnerAgent,
    pool: ExactEnvPool,
    start_of: Callable[[int], int],
    underway: Underway,
    advance: Callable[[int], MetricsTuple | None],
    counts: "_train.Counts",
) -> Iterator[AgentStep]:
    """The steps of `loop.interact`, of which only some are yielded, endless.

    Those are the steps that ended an episode or completed a metrics period, and those after which
    the episode of environment 0 has a multiple of `STEPS_BETWEEN_LOOKS` steps.

    Args:
        agent: acts and learns.
        pool: the environments.
        start_of: the environment seed of an episode, by its number.
        underway: the current episode in each environment, updated before each step is yielded.
        advance: takes at most that many steps in C++; see `_train.Loop.advance`.
        counts: those that C++ writes to.
    """
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
            counts.epsilon_used,
            ended,
            None if metrics is None else agent.measured(Metrics(*metrics)),
            (agent.env_steps - before) // len(actions),
        )
