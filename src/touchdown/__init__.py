"""Touchdown: a deep Q-learning laboratory for the lunar lander.

The functions here do what the verbs of the command line do. They load what they need when they are
first used, so that importing the package is quick.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from touchdown.api.studies import (
        compare,
        list_studies,
        run_study,
        study_report,
        study_status,
        tune_agent,
    )
    from touchdown.api.verbs import evaluate, export, fly, resume, show, train, tune_pid
    from touchdown.config.config import Config
    from touchdown.config.presets import PRESETS, preset
    from touchdown.core.errors import Interrupted, UserError
    from touchdown.runs.run import Run, list_runs

_HOMES = {
    "Config": "config.config",
    "Interrupted": "core.errors",
    "PRESETS": "config.presets",
    "Run": "runs.run",
    "UserError": "core.errors",
    "compare": "api.studies",
    "evaluate": "api.verbs",
    "export": "api.verbs",
    "fly": "api.verbs",
    "list_runs": "runs.run",
    "list_studies": "api.studies",
    "preset": "config.presets",
    "resume": "api.verbs",
    "run_study": "api.studies",
    "show": "api.verbs",
    "study_report": "api.studies",
    "study_status": "api.studies",
    "train": "api.verbs",
    "tune_agent": "api.studies",
    "tune_pid": "api.verbs",
}

__version__ = "0.1.0"
__all__ = [
    "PRESETS",
    "Config",
    "Interrupted",
    "Run",
    "UserError",
    "compare",
    "evaluate",
    "export",
    "fly",
    "list_runs",
    "list_studies",
    "preset",
    "resume",
    "run_study",
    "show",
    "study_report",
    "study_status",
    "train",
    "tune_agent",
    "tune_pid",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'touchdown' has no attribute {name!r}")
    return getattr(importlib.import_module(f"touchdown.{_HOMES[name]}"), name)
