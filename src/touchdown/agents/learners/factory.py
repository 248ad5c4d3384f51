"""The learner that a config describes."""

from touchdown.agents.learners.backend import backend_of
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.learners.jax import JaxLearner
from touchdown.agents.learners.learner import Learner
from touchdown.agents.networks import make_network
from touchdown.config.config import Config
from touchdown.core.types import Spaces


def make_learner(config: Config, spaces: Spaces) -> Learner:
    """A fresh learner of the config's network, on the config's backend.

    Raises:
        UserError: the config selects the fused kernel, which was not built.
    """
    network = make_network(config.network, spaces)
    match backend_of(config):
        case "jax":
            return JaxLearner(network, config)
        case "fused":
            return FusedLearner(network, config)
