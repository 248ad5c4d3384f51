"""Deep Q-learning from parts: act, store the step, update every `update_period` steps."""

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.actor import periods_crossed
from touchdown.agents.learner_agent import LearnerAgent
from touchdown.agents.learners.learner import Learner, Metrics
from touchdown.config.config import Config
from touchdown.config.sections import ReplayConfig
from touchdown.core import records
from touchdown.core.records import Count
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, IntArray, Spaces, StepResult
from touchdown.replay import n_step
from touchdown.replay.n_step import NStep
from touchdown.replay.priorities import Proportional
from touchdown.replay.replay import Replay, Sample


def _proportional(config: ReplayConfig) -> Proportional | None:
    if not config.prioritized:
        return None
    return Proportional(config.alpha, config.beta, config.beta_duration)


class DQNAgent(LearnerAgent):
    """Algorithm 2, optionally with the paper's target network and re-saves.

    Args:
        config: all settings.
        spaces: the environment's sizes.
        streams: the run's random generators.
        learner: a learner of the config's network.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams, learner: Learner) -> None:
        super().__init__(config, spaces, streams, learner)
        self.replay = Replay(
            config.replay.capacity,
            spaces.observation_size,
            config.replay.resaves,
            config.replay.resave_threshold,
            _proportional(config.replay),
            self.mirror,
        )
        learning = config.learning
        self.n_steps = [
            NStep(learning.n_step, learning.gamma, needs_next_action=learning.target == "sarsa")
            for _ in range(config.training.num_envs)
        ]

    def act(self, observations: FloatArray) -> IntArray:
        """ε-greedy actions (Algorithm 2, line 4), with noisy weights if the network has them.

        [N, D] to [N].
        """
        return self._actor.act(
            len(observations), lambda: self.learner.values(observations, self.env_steps)
        )

    def observe(
        self,
        o_tm1: FloatArray,
        a_tm1: IntArray,
        steps: StepResult,
        next_observations: FloatArray,
    ) -> dict[str, float] | None:
        """Store transitions and learn from minibatches (Algorithm 2, lines 6-12).

        Returns:
            Metrics of the latest update once per `metrics_period` updates, otherwise None. Q is in
            units of the reward before scaling.
        """
        self._store(o_tm1, a_tm1, steps)
        before = self._actor.observed(steps)
        self._actor.next_q = None
        learning = self._config.learning
        due = periods_crossed(before, self.env_steps, learning.update_period)
        metrics = None
        if due and len(self.replay) >= self._config.replay.min_size:
            metrics = self._update(due * learning.gradient_steps, next_observations)
        period = learning.target_period
        if period and periods_crossed(before, self.env_steps, period):
            self.learner.copy_target()
        return metrics

    def _store(self, o_tm1: FloatArray, a_tm1: IntArray, steps: StepResult) -> None:
        actions, rewards = a_tm1.tolist(), steps.rewards.tolist()
        terminated, truncated = steps.terminated.tolist(), steps.truncated.tolist()
        for index, window in enumerate(self.n_steps):
            o_t = steps.observations[index]
            complete = window.push(
                o_tm1[index], actions[index], rewards[index], o_t, terminated=terminated[index]
            )
            if truncated[index] and not terminated[index]:  # truncation still bootstraps
                complete += window.truncate(self._action_after(o_t))
            for transition in complete:
                self.replay.add(transition)

    def _action_after(self, observation: FloatArray) -> int:
        """The action that a truncated episode would have taken next, if the TD target needs it.

        Args:
            observation: last observation of the episode, [D].
        """
        if self._config.learning.target != "sarsa":
            return 0
        self._actor.next_q = None
        return int(self.act(observation[None])[0])

    def _update(self, count: int, next_observations: FloatArray) -> dict[str, float] | None:
        batch_size = self._config.learning.batch_size
        samples = [self.replay.sample(batch_size, self._rng) for _ in range(count)]
        before = self._actor.updates
        self._actor.updates += count
        measured = self._actor.metrics_due(before)
        metrics, td_errors, self._actor.next_q = self.learner.update(
            _packed(samples), _weights(samples), next_observations, before, measured=measured
        )
        self._add_to_average()
        if samples[0].weights is not None:
            errors: FloatArray = np.asarray(td_errors)
            for sample, td_error in zip(samples, errors, strict=True):
                self.replay.update_priorities(sample.indices, td_error)
        return None if metrics is None else self.measured(metrics)

    def measured(self, metrics: Metrics) -> dict[str, float]:
        """An update's metrics and the memory's shares by name, for the records."""
        shares = self.replay.shares()
        return {
            **super().measured(metrics),
            "rewarded_share": shares.rewarded,
            "terminal_share": shares.terminal,
        }

    def state(self) -> dict[str, Any]:
        """The learner's state, the replay memory, unfinished n-step returns, and the actor's."""
        return {
            **super().state(),
            "memory": self.replay.tensors(),
            "n_step": n_step.tensors_of(self.n_steps),
            "memory_added": self.replay.ring.added,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        records.check(state["memory_added"], Count, "agent.memory_added")
        self.replay.restore(state["memory"], state["memory_added"])
        n_step.restore(self.n_steps, state["n_step"])
        super().restore(state)


def _packed(samples: list[Sample]) -> NDArray[np.float32]:
    """K samples of B transitions as 4-byte entries, [K, B, W]."""
    records = np.stack([sample.records for sample in samples])
    return records.view(np.float32).reshape(*records.shape, -1)


def _weights(samples: list[Sample]) -> NDArray[np.float32] | None:
    """The samples' importance-sampling weights, [K, B], or None for uniform replay."""
    if samples[0].weights is None:
        return None
    return np.stack([cast(NDArray[np.float32], sample.weights) for sample in samples])
