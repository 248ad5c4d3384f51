"""The learner that a config describes."""

from touchdown.agents.learners.backend import backend_of
from touchdown.agents.learners.learner import Learner
from touchdown.config.config import Config
from touchdown.core.types import Spaces


def make_learner(config: Config, spaces: Spaces) -> Learner:
    """A fresh learner of the config's network, on the config's backend.

    Raises:
        UserError: the config selects the fused kernel, which was not built, or this process was
            forked after JAX had started.
    """
    # each loads what it needs: JAX takes longer to load than a short training takes
    if backend_of(config) == "fused":
        from touchdown.agents.learners.fused import FusedLearner  # noqa: PLC0415
        from touchdown.agents.learners.fused_network import FusedNetwork  # noqa: PLC0415

        network = FusedNetwork(spaces.observation_size, spaces.num_actions, config.network)
        return FusedLearner(network, config)
    from touchdown.agents.learners.jax import JaxLearner  # noqa: PLC0415
    from touchdown.agents.networks import make_network  # noqa: PLC0415

    return JaxLearner(make_network(config.network, spaces), config)
