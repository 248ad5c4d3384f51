"""The part that agents with a learner share: DQN and PQN."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.actor import ActingAgent, Actor
from touchdown.agents.learners.learner import Learner, Metrics, check_tensors
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, Policy, Spaces, Tensors
from touchdown.replay.mirrored import mirror_of


class LearnerAgent(ActingAgent):
    """The weights and the policy of an agent, which its learner provides.

    Args:
        config: all settings.
        spaces: the environment's sizes.
        streams: the run's random generators.
        learner: a learner of the config's network.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams, learner: Learner) -> None:
        super().__init__(Actor(config, spaces.num_actions, streams.exploration))
        self._config = config
        self._rng = streams.replay
        self.learner = learner
        self.mirror = mirror_of(config, spaces)
        """The symmetry whose images it learns from; None if the config asks for none."""
        self.average: NDArray[np.float32] | None = None
        """The average of the online weights, [P]; None if the config asks for none."""
        if config.learning.averaging:
            self.average = np.array(learner.state.online_params)

    def _add_to_average(self) -> None:
        if self.average is not None:
            online = np.asarray(self.learner.state.online_params)
            self.average += np.float32(self._config.learning.averaging) * (online - self.average)

    def weights(self) -> Tensors:
        """The parameters by name, as copies: their average, or the online network's."""
        online = self.learner.state.online_params
        return self._named(np.asarray(online) if self.average is None else self.average)

    def state(self) -> dict[str, Any]:
        """The learner's state, the average, and the actor's."""
        average = {} if self.average is None else {"average": {"params": self.average.copy()}}
        return {**average, "learner": self.learner.tensors(), **self._actor.state()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        if self.average is not None:
            average = state["average"]["params"]
            check_tensors({"average": average}, {"average": self.average})
            self.average[...] = average
        self.learner.restore(state["learner"])
        self._actor.restore(state)

    def _named(self, params: FloatArray) -> Tensors:
        """Copies of flat parameters [P] by name."""
        layers = self.learner.model.layers(params)
        return {name: np.array(value) for name, value in layers.items()}

    def measured(self, metrics: Metrics) -> dict[str, float]:
        """An update's metrics by name, for the records. Q is in units of the unscaled reward."""
        return metrics.to_floats(self._config.learning.reward_scale)

    def policy(self, weights: Tensors) -> Policy:
        """The greedy policy of these parameters.

        Raises:
            ValueError: their names, shapes or types are not those of the network.
        """
        model = self.learner.model
        return model.policy(model.params_of(weights))
