"""The network of weights that are only to act: computed by the fused kernel where it can be."""

from typing import TYPE_CHECKING, TypeAlias, Union

from touchdown.agents.learners.backend import acts_fused
from touchdown.config.sections import NetworkConfig
from touchdown.core.types import Spaces

if TYPE_CHECKING:
    from touchdown.agents.learners.fused_network import FusedNetwork
    from touchdown.agents.networks import QNetwork

Network: TypeAlias = Union["FusedNetwork", "QNetwork"]


def network_to_act(config: NetworkConfig, spaces: Spaces) -> Network:
    """The Q-network that a config describes, for an environment's sizes.

    Raises:
        UserError: it needs JAX, and this process was forked after JAX had started.
    """
    sizes = spaces.observation_size, spaces.num_actions, config
    # each loads what it needs: JAX takes longer to load than a policy takes to fly
    if acts_fused(config):
        from touchdown.agents.learners.fused_network import FusedNetwork  # noqa: PLC0415

        return FusedNetwork(*sizes)
    from touchdown.agents.networks import QNetwork  # noqa: PLC0415

    return QNetwork(*sizes)
