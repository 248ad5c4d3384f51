"""The parts that all agents share: exploratory actions, and the counts that schedules depend on."""

from collections.abc import Callable, Mapping
from typing import Any

import msgspec
import numpy as np
from numpy.random import Generator

from touchdown.agents.exploration import EpsilonGreedy
from touchdown.config.config import Config
from touchdown.core import records
from touchdown.core.records import Count, Share
from touchdown.core.types import FloatArray, IntArray, StepResult


def periods_crossed(before: int, after: int, period: int) -> int:
    """How many multiples of `period` a count passes from `before` to `after`."""
    return after // period - before // period


class _Counts(msgspec.Struct, frozen=True, rename={"env_steps": "observations"}):
    """An actor's counts in a checkpoint."""

    env_steps: Count
    episodes: Count
    updates: Count
    epsilon: Share


class Actor:
    """Chooses ε-greedy actions, and counts environment steps, episodes and updates.

    Args:
        config: all settings.
        num_actions: A.
        rng: random generator for exploration.
    """

    def __init__(self, config: Config, num_actions: int, rng: Generator) -> None:
        self.env_steps = 0
        self.episodes = 0
        """Episodes that have ended."""
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

    def observed(self, steps: StepResult) -> int:
        """Count environment steps and the episodes that ended in them, and set ε.

        Returns:
            The count of environment steps before them.
        """
        before, self.env_steps = self.env_steps, self.env_steps + len(steps.rewards)
        self.episodes += int(np.count_nonzero(steps.ended))
        self._explorer.schedule(self.episodes, self.env_steps)
        return before

    def count(self, *, env_steps: int, episodes: int, updates: int) -> None:
        """Set all counts, and ε by them."""
        self.env_steps, self.episodes, self.updates = env_steps, episodes, updates
        self._explorer.schedule(episodes, env_steps)

    def metrics_due(self, updates_before: int) -> bool:
        """Whether a metrics period was completed by the updates since `updates_before`."""
        return periods_crossed(updates_before, self.updates, self._metrics_period) > 0

    def state(self) -> dict[str, Any]:
        """Counts, ε, and the values for the next actions if they are known, for a checkpoint."""
        return {
            "acting": {} if self.next_q is None else {"next_q": np.array(self.next_q)},
            "observations": self.env_steps,
            "episodes": self.episodes,
            "updates": self.updates,
            "epsilon": self.epsilon,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        names = ("observations", "episodes", "updates", "epsilon")
        counts = {name: state[name] for name in names if name in state}
        records.check(counts, _Counts, "agent")
        next_q = state["acting"].get("next_q")
        self.next_q = None if next_q is None else next_q.copy()
        self.env_steps, self.episodes = counts["observations"], counts["episodes"]
        self.updates = counts["updates"]
        self._explorer.epsilon = float(counts["epsilon"])


class ActingAgent:
    """The counts of an agent, kept by its actor.

    Args:
        actor: the agent's actor.
    """

    def __init__(self, actor: Actor) -> None:
        self._actor = actor

    @property
    def actor(self) -> Actor:
        """Its actor."""
        return self._actor

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
