"""Studies: many runs, the claims about them, and their verdicts.

The classes for a study in Python can be imported from here: `Study`, `Factor`, `Level`, `Claim`,
and the kinds of claims. Each is loaded when it is first used, because a worker needs none of them.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from touchdown.studies.claim_tests import (
        Alike,
        Best,
        Beyond,
        Greater,
        Near,
        SweetSpot,
        Trend,
    )
    from touchdown.studies.claims import Claim
    from touchdown.studies.plan import Factor, Level, Study

_HOMES = {
    "Alike": "claim_tests",
    "Best": "claim_tests",
    "Beyond": "claim_tests",
    "Claim": "claims",
    "Factor": "plan",
    "Greater": "claim_tests",
    "Level": "plan",
    "Near": "claim_tests",
    "Study": "plan",
    "SweetSpot": "claim_tests",
    "Trend": "claim_tests",
}

__all__ = [
    "Alike",
    "Best",
    "Beyond",
    "Claim",
    "Factor",
    "Greater",
    "Level",
    "Near",
    "Study",
    "SweetSpot",
    "Trend",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'touchdown.studies' has no attribute {name!r}")
    return getattr(importlib.import_module(f"touchdown.studies.{_HOMES[name]}"), name)
