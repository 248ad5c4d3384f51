"""The part that agents with a learner share: DQN and PQN."""

import numpy as np

from touchdown.agents.actor import ActingAgent, Actor
from touchdown.agents.learners.learner import Learner, Metrics
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, Policy, Spaces, Tensors


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

    def weights(self) -> Tensors:
        """The online network's parameters by name: copies, as later updates change them."""
        return self._named(np.asarray(self.learner.state.online_params))

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
