"""PQN: Q-learning in parallel environments without a replay memory or a target network.

Gallici et al., 2025: λ-returns over a short rollout of all environments, a few epochs of
minibatches, and layer normalisation, which stabilises bootstrapping in place of a target network.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from touchdown.agents.learner_agent import LearnerAgent
from touchdown.agents.learners.learner import Learner
from touchdown.agents.rollout import Rollout
from touchdown.config.config import Config
from touchdown.core import records
from touchdown.core.records import Count
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, IntArray, Spaces, StepResult
from touchdown.replay.mirrored import Mirrored


class PQNAgent(LearnerAgent):
    """Learns from each rollout of all environments as soon as it is complete.

    Args:
        config: all settings; its algorithm is `pqn`.
        spaces: the environment's sizes.
        streams: the run's random generators.
        learner: a learner of the config's network.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams, learner: Learner) -> None:
        super().__init__(config, spaces, streams, learner)
        shape = config.rollout.rollout_steps, config.training.num_envs
        wide = *shape, spaces.observation_size
        self.rollout = Rollout(
            o_tm1=np.zeros(wide, np.float32),
            a_tm1=np.zeros(shape, np.int32),
            r_t=np.zeros(shape, np.float32),
            o_t=np.zeros(wide, np.float32),
            terminated=np.zeros(shape, np.float32),
            truncated=np.zeros(shape, np.float32),
        )
        """The current rollout, in arrays of NumPy."""
        self.num_filled = 0
        """Its steps so far."""
        self._mirrored = None if self.mirror is None else Mirrored(self.mirror)

    def act(self, observations: FloatArray) -> IntArray:
        """ε-greedy actions: [N, D] to [N]."""
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
        """Store one step of every environment, and learn if it completes the rollout.

        Returns:
            Metrics of the latest update once per `metrics_period` updates, otherwise None.
        """
        truncated = steps.truncated & ~steps.terminated
        step = (o_tm1, a_tm1, steps.rewards, steps.observations, steps.terminated, truncated)
        for stored, value in zip(self.rollout, step, strict=True):
            stored[self.num_filled] = value
        self.num_filled += 1
        self._actor.next_q = None
        self._actor.observed(steps)
        if self.num_filled < self._config.rollout.rollout_steps:
            return None
        self.num_filled = 0
        return self._learn(next_observations)

    def _learn(self, next_observations: FloatArray) -> dict[str, float] | None:
        config = self._config.rollout
        if self._mirrored is not None:
            self._mirror_half(self._mirrored)
        size = self.rollout.r_t.size
        orders = [
            self._rng.permutation(size)[: size - size % config.minibatches]
            for _ in range(config.epochs)
        ]
        order = np.concatenate(orders).reshape(config.epochs * config.minibatches, -1)
        metrics, self._actor.next_q = self.learner.fit_rollout(
            self.rollout, order, next_observations
        )
        before = self._actor.updates
        self._actor.updates += len(order)
        self._add_to_average()
        if not self._actor.metrics_due(before):
            return None
        return self.measured(metrics)

    def _mirror_half(self, mirrored: Mirrored) -> None:
        """Replace the steps of some environments, half of them on average, by their images."""
        chosen = self._rng.random(self._config.training.num_envs) < 0.5
        for stored, image_of in (
            (self.rollout.o_tm1, mirrored.observations),
            (self.rollout.a_tm1, mirrored.actions),
            (self.rollout.o_t, mirrored.observations),
        ):
            stored[:, chosen] = image_of(stored[:, chosen])

    def state(self) -> dict[str, Any]:
        """The learner's state, the unfinished rollout, and the actor's."""
        return {
            **super().state(),
            "rollout": self.rollout._asdict(),
            "filled": self.num_filled,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        records.check(state["filled"], Count, "agent.filled")
        for name, part in self.rollout._asdict().items():
            part[:] = state["rollout"][name]
        steps = self._config.rollout.rollout_steps
        if state["filled"] >= steps:  # the agent would have learned from a complete rollout
            raise ValueError(f"agent.filled = {state['filled']}: must be less than {steps} steps")
        super().restore(state)
        self.num_filled = int(state["filled"])
