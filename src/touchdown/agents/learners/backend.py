"""What computes a config's updates: JAX, or the fused kernel."""

import importlib.util
from typing import Literal

from touchdown.config.config import Config
from touchdown.config.rules import why_not_fused
from touchdown.core import device


def is_built() -> bool:
    """Whether the C++ kernel was built when the package was installed."""
    return importlib.util.find_spec("touchdown.agents.learners._fused") is not None


def backend_of(config: Config) -> Literal["jax", "fused"]:
    """The config's backend; for `auto`, the fused kernel where it can be used, otherwise JAX."""
    backend = config.learning.backend
    if backend != "auto":
        return backend
    on_gpu = device.chosen() == "gpu"
    return "jax" if on_gpu or not is_built() or why_not_fused(config) else "fused"
