"""Imports onnxruntime without its telemetry."""

import os
from importlib import import_module
from typing import Any

from touchdown.core import installation


def load(where: str) -> Any:
    """The module `onnxruntime`.

    Its official builds send events to their maker. They stop only if a variable of the environment
    says so before the first import: `ORT_DISABLE_TELEMETRY=0` keeps them.

    Args:
        where: what needs it, for the error message.

    Raises:
        UserError: it is not installed.
    """
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
    try:
        return import_module("onnxruntime")
    except ImportError:
        raise installation.missing(where, "onnxruntime", "onnx") from None
