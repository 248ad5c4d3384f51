"""The parts that all agents share: exploratory actions, and the counts that schedules depend on."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.random import Generator

from touchdown.agents.exploration import EpsilonGreedy
from touchdown.config.config import Config
from touchdown.core.types import FloatArray, IntArray, Tensors


def periods_crossed(before: int, after: int, period: int) -> int:
    """How many multiples of `period` a count passes from `before` to `after`."""
    return after // period - before // period


class Actor:
    """Chooses ε-greedy actions, and counts environment steps and updates.

    Args:
        config: all settings.
        num_actions: A.
        rng: random generator for exploration.
    """

    def __init__(self, config: Config, num_actions: int, rng: Generator) -> None:
        self.env_steps = 0
        self.updates = 0
        self.next_q: Any | None = None
        """Q(s,·) for the next actions, [N, A], if an update has already computed it.

        JAX may still be computing it; only a greedy action waits for it.
        """
        self._explorer = EpsilonGreedy(config.exploration, num_actions, rng)
        self._metrics_period = config.training.metrics_period

    @property
    def epsilon(self) -> float:
        """The probability of a random action."""
        return self._explorer.epsilon

    def begin_episode(self, ended: int) -> None:
        """Set ε for an episode that begins after `ended` finished episodes."""
        self._explorer.begin_episode(ended, self.env_steps)

    def act(self, count: int, values: Callable[[], FloatArray]) -> IntArray:
        """Choose an action in each of `count` environments, [N].

        Args:
            count: N.
            values: computes Q(s,·) in each environment, [N, A]; called only if an action is greedy
                and `next_q` is not known.
        """

        def known_or_computed() -> FloatArray:
            return values() if self.next_q is None else np.asarray(self.next_q)

        return self._explorer.act(count, known_or_computed)

    def observed(self, count: int) -> int:
        """Count environment steps and update ε.

        Returns:
            The count before them.
        """
        before, self.env_steps = self.env_steps, self.env_steps + count
        self._explorer.observed(self.env_steps)
        return before

    def metrics_due(self, updates_before: int) -> bool:
        """Whether a metrics period was completed by the updates since `updates_before`."""
        return periods_crossed(updates_before, self.updates, self._metrics_period) > 0

    def tensors(self) -> Tensors:
        """The values for the next actions, if they are known, for a checkpoint."""
        return {} if self.next_q is None else {"next_q": np.array(self.next_q)}

    def facts(self) -> dict[str, Any]:
        """Counts and ε, as JSON values."""
        return {
            "observations": self.env_steps,
            "updates": self.updates,
            "epsilon": self.epsilon,
        }

    def restore(self, tensors: Tensors, facts: Mapping[str, Any]) -> None:
        """Restore the state that `tensors` and `facts` returned.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        next_q = tensors.get("next_q")
        self.next_q = None if next_q is None else next_q.copy()
        self.env_steps, self.updates = facts["observations"], facts["updates"]
        self._explorer.epsilon = float(facts["epsilon"])


class ActingAgent:
    """The part of the `Agent` protocol that delegates to an actor.

    Args:
        actor: the agent's actor.
    """

    def __init__(self, actor: Actor) -> None:
        self._actor = actor

    @property
    def env_steps(self) -> int:
        """Environment steps observed so far."""
        return self._actor.env_steps

    @property
    def updates(self) -> int:
        """Updates of the parameters so far."""
        return self._actor.updates

    @property
    def epsilon(self) -> float:
        """The probability of a random action."""
        return self._actor.epsilon

    def begin_episode(self, ended: int) -> None:
        """Set ε, if its schedule counts episodes."""
        self._actor.begin_episode(ended)
