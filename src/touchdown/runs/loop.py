"""Which training loop a run uses: the compiled one where it supports the config, or Python's."""

import importlib.util
from typing import Literal

from touchdown.config.config import Config
from touchdown.lander.engine import engine_in_use
from touchdown.lander.rules import is_lander

Loop = Literal["compiled", "python"]

# the values of settings that the compiled loop supports, by section; every other setting is free
_SUPPORTED = {
    "": {"algorithm": "dqn"},
    "learning": {"backend": "fused", "target": "q-learning"},
    "replay": {"prioritized": False},
}


def is_built() -> bool:
    """Whether the compiled loop was built when the package was installed."""
    return importlib.util.find_spec("touchdown.training._train") is not None


def why_python(config: Config) -> str | None:
    """Why a run with these settings uses Python's loop, in a few words; None if it does not.

    Both give the same bytes; the compiled loop is faster.
    """
    for section, values in _SUPPORTED.items():
        of_section = getattr(config, section) if section else config
        for name, supported in values.items():
            if (value := getattr(of_section, name)) != supported:
                return f"{name} = {value!r}"
    if not is_lander(config.env_id):
        return f"env_id = {config.env_id!r}"
    if (engine := engine_in_use()) != "exact":
        return f"engine = {engine!r}"
    return None if is_built() else "the compiled loop was not built"
