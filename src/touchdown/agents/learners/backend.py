"""What computes a config's updates: JAX, or the fused kernel."""

import importlib.util
from typing import Literal

from touchdown.config.config import Config
from touchdown.config.rules import why_not_fused, why_not_fused_network
from touchdown.config.sections import NetworkConfig
from touchdown.core import device


def is_built() -> bool:
    """Whether the C++ kernel was built when the package was installed."""
    return importlib.util.find_spec("touchdown.agents.learners._fused") is not None


def backend_of(config: Config) -> Literal["jax", "fused"]:
    """The config's backend; for `auto`, the fused kernel where it can be used, otherwise JAX."""
    backend = config.learning.backend
    if backend != "auto":
        return backend
    return "fused" if _can_be_used() and not why_not_fused(config) else "jax"


def acts_fused(network: NetworkConfig) -> bool:
    """Whether the fused kernel can compute the values of a network here, whoever trained it."""
    return _can_be_used() and not why_not_fused_network(network)


def _can_be_used() -> bool:
    return device.chosen() != "gpu" and is_built()
