"""Touchdown: a deep Q-learning laboratory for the lunar lander.

The functions here do the same as the verbs of the command line. They are loaded on first use, so
importing the package is fast.
"""

import importlib
from typing import TYPE_CHECKING, Any

from touchdown.core.version import __version__ as __version__

if TYPE_CHECKING:
    from touchdown.api.exporting import export
    from touchdown.api.flying import evaluate, fly
    from touchdown.api.learning_film import fly_over_training
    from touchdown.api.playing import play
    from touchdown.api.runs import show
    from touchdown.api.studies import (
        compare,
        list_studies,
        run_study,
        study_report,
        study_status,
        tune_agent,
    )
    from touchdown.api.training import resume, train
    from touchdown.api.tuning import tune_pid
    from touchdown.api.watching import watch
    from touchdown.config.config import Config
    from touchdown.config.presets import PRESETS, preset
    from touchdown.core.errors import Interrupted, UserError
    from touchdown.runs.run import Run, list_runs
    from touchdown.studies.claims import Claim
    from touchdown.studies.plan import Factor, Level, Study
    from touchdown.training.listeners import Listener
    from touchdown.training.loggers import JsonLinesLogger, TensorBoardLogger

_HOMES = {
    "Claim": "studies.claims",
    "Config": "config.config",
    "Factor": "studies.plan",
    "Interrupted": "core.errors",
    "Level": "studies.plan",
    "JsonLinesLogger": "training.loggers",
    "Listener": "training.listeners",
    "PRESETS": "config.presets",
    "Run": "runs.run",
    "Study": "studies.plan",
    "TensorBoardLogger": "training.loggers",
    "UserError": "core.errors",
    "compare": "api.studies",
    "evaluate": "api.flying",
    "export": "api.exporting",
    "fly": "api.flying",
    "fly_over_training": "api.learning_film",
    "list_runs": "runs.run",
    "list_studies": "api.studies",
    "play": "api.playing",
    "preset": "config.presets",
    "resume": "api.training",
    "run_study": "api.studies",
    "show": "api.runs",
    "study_report": "api.studies",
    "study_status": "api.studies",
    "train": "api.training",
    "tune_agent": "api.studies",
    "tune_pid": "api.tuning",
    "watch": "api.watching",
}

__all__ = [
    "PRESETS",
    "Claim",
    "Config",
    "Factor",
    "Interrupted",
    "JsonLinesLogger",
    "Level",
    "Listener",
    "Run",
    "Study",
    "TensorBoardLogger",
    "UserError",
    "compare",
    "evaluate",
    "export",
    "fly",
    "fly_over_training",
    "list_runs",
    "list_studies",
    "play",
    "preset",
    "resume",
    "run_study",
    "show",
    "study_report",
    "study_status",
    "train",
    "tune_agent",
    "tune_pid",
    "watch",
]


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'touchdown' has no attribute {name!r}")
    return getattr(importlib.import_module(f"touchdown.{_HOMES[name]}"), name)
