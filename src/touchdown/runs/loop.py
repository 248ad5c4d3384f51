"""Which training loop a run uses: the compiled one where it supports the config, or Python's."""

import importlib.util
from typing import Literal

from touchdown.agents.learners.backend import backend_of
from touchdown.config.config import Config
from touchdown.lander.engine import engine_in_use
from touchdown.lander.rules import is_lander

Loop = Literal["compiled", "python"]


def is_built() -> bool:
    """Whether the compiled loop was built when the package was installed."""
    return importlib.util.find_spec("touchdown.training._train") is not None


def why_python(config: Config) -> str | None:
    """Why a run with these settings uses Python's loop, in a few words; None if it does not.

    Both give the same bytes; the compiled loop is faster.
    """
    if reason := _unsupported(config):
        return reason
    if (engine := engine_in_use()) != "exact":
        return f"engine = {engine!r}"
    return None if is_built() else "the compiled loop was not built"


def _unsupported(config: Config) -> str | None:
    """A setting that only Python's loop supports."""
    if config.algorithm not in ("dqn", "pqn"):
        return f"algorithm = {config.algorithm!r}"
    if (backend := backend_of(config)) != "fused":
        return f"backend = {backend!r}"
    return None if is_lander(config.env_id) else f"env_id = {config.env_id!r}"
