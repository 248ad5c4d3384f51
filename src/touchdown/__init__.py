"""Touchdown: a deep Q-learning laboratory for the lunar lander.

The functions here do what the verbs of the command line do. They load what they need when they are
first used, so that importing the package is quick.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from touchdown.config import Config
    from touchdown.errors import Interrupted, UserError
    from touchdown.presets import PRESETS, preset
    from touchdown.runs.run import Run, list_runs
    from touchdown.verbs import evaluate, export, fly, resume, show, train, tune_pid

_HOMES = {
    "Config": "config",
    "Interrupted": "errors",
    "PRESETS": "presets",
    "Run": "runs.run",
    "UserError": "errors",
    "evaluate": "verbs",
    "export": "verbs",
    "fly": "verbs",
    "list_runs": "runs.run",
    "preset": "presets",
    "resume": "verbs",
    "show": "verbs",
    "train": "verbs",
    "tune_pid": "verbs",
}

__version__ = "0.1.0"
__all__ = [
    "PRESETS",
    "Config",
    "Interrupted",
    "Run",
    "UserError",
    "evaluate",
    "export",
    "fly",
    "list_runs",
    "preset",
    "resume",
    "show",
    "train",
    "tune_pid",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'touchdown' has no attribute {name!r}")
    return getattr(importlib.import_module(f"touchdown.{_HOMES[name]}"), name)
