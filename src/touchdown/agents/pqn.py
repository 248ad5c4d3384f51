"""PQN: Q-learning in parallel environments without a replay memory or a target network.

Gallici et al., 2025: λ-returns over a short rollout of all environments, a few epochs of
minibatches, and layer normalisation, which stabilises bootstrapping in place of a target network.
"""

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.actor import ActingAgent, Actor
from touchdown.agents.agent import Model
from touchdown.agents.learners.learner import Learner
from touchdown.agents.rollout import Rollout
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, IntArray, Spaces, StepResult, Tensors


class PQNAgent(ActingAgent):
    """Learns from each rollout of all environments as soon as it is complete.

    Args:
        config: all settings; its algorithm is `pqn`.
        spaces: the environment's sizes.
        streams: the run's random generators.
        learner: a learner of the config's network.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams, learner: Learner) -> None:
        super().__init__(Actor(config, spaces.num_actions, streams.exploration))
        self._config = config
        self._rng = streams.replay
        self.learner = learner
        shape = config.rollout.rollout_steps, config.training.num_envs
        wide = *shape, spaces.observation_size
        self._rollout: dict[str, NDArray[Any]] = {
            name: np.zeros(wide if name in ("o_tm1", "o_t") else shape, np.float32)
            for name in Rollout._fields
        }
        self._rollout["a_tm1"] = np.zeros(shape, np.int32)
        self._num_filled = 0  # steps of the rollout so far

    @property
    def model(self) -> Model:
        """The network."""
        return self.learner.model

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
        for stored, value in zip(self._rollout.values(), step, strict=True):
            stored[self._num_filled] = value
        self._num_filled += 1
        self._actor.next_q = None
        self._actor.observed(len(a_tm1))
        if self._num_filled < self._config.rollout.rollout_steps:
            return None
        self._num_filled = 0
        return self._learn(next_observations)

    def _learn(self, next_observations: FloatArray) -> dict[str, float] | None:
        config = self._config.rollout
        size = self._rollout["r_t"].size
        orders = [
            self._rng.permutation(size)[: size - size % config.minibatches]
            for _ in range(config.epochs)
        ]
        order = np.concatenate(orders).reshape(config.epochs * config.minibatches, -1)
        rollout = Rollout(**cast(Any, self._rollout))
        metrics, self._actor.next_q = self.learner.fit_rollout(rollout, order, next_observations)
        before = self._actor.updates
        self._actor.updates += len(order)
        if not self._actor.metrics_due(before):
            return None
        return metrics.to_floats(self._config.learning.reward_scale)

    def recall(
        self, index: int, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray
    ) -> None:
        """Do nothing, as the checkpoint contains the unfinished rollout."""

    def params(self) -> FloatArray:
        """A copy of the network's parameters, [P], as later updates change them."""
        return np.array(self.learner.state.online_params)

    def tensors(self) -> dict[str, Tensors]:
        """The learner's state, the unfinished rollout, and the values for the next actions."""
        return {
            "learner": self.learner.tensors(),
            "rollout": self._rollout,
            "acting": self._actor.tensors(),
        }

    def facts(self) -> dict[str, Any]:
        """Counts and ε."""
        return {**self._actor.facts(), "filled": self._num_filled}

    def restore(self, tensors: Mapping[str, Tensors], facts: Mapping[str, Any]) -> None:
        """Restore the state that `tensors` and `facts` returned.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        self.learner.restore(tensors["learner"])
        for name, part in self._rollout.items():
            part[:] = tensors["rollout"][name]
        steps = self._config.rollout.rollout_steps
        if facts["filled"] >= steps:  # the agent would have learned from a complete rollout
            raise ValueError(f"agent.filled = {facts['filled']}: must be less than {steps} steps")
        self._actor.restore(tensors["acting"], facts)
        self._num_filled = int(facts["filled"])
