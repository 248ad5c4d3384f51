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
    from touchdown.studying import (
        compare,
        list_studies,
        run_study,
        study_report,
        study_status,
        tune_agent,
    )
    from touchdown.verbs import evaluate, export, fly, resume, show, train, tune_pid

_HOMES = {
    "Config": "config",
    "Interrupted": "errors",
    "PRESETS": "presets",
    "Run": "runs.run",
    "UserError": "errors",
    "compare": "studying",
    "evaluate": "verbs",
    "export": "verbs",
    "fly": "verbs",
    "list_runs": "runs.run",
    "list_studies": "studying",
    "preset": "presets",
    "resume": "verbs",
    "run_study": "studying",
    "show": "verbs",
    "study_report": "studying",
    "study_status": "studying",
    "train": "verbs",
    "tune_agent": "studying",
    "tune_pid": "verbs",
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
