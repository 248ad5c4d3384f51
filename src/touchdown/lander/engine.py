"""Which engine simulates the lander: the exact one in C++, or stock Gymnasium."""

import importlib.util
import warnings
from typing import Literal

from touchdown.core import installation
from touchdown.core.errors import UserError

Engine = Literal["exact", "gymnasium"]

_chosen: list[Engine] = []
_built = importlib.util.find_spec("touchdown.lander._engine") is not None


def engine_built() -> bool:
    """Whether the exact engine was compiled with this installation."""
    return _built


def use_engine(engine: Engine) -> None:
    """Select the engine that simulates the lander; results are the same to the last bit.

    Args:
        engine: `exact`, the engine in C++, or `gymnasium`, the stock environment.

    Raises:
        UserError: there is no such engine, or the exact one was not built.
    """
    check_engine(engine)
    _chosen.append(engine)


def check_engine(engine: Engine) -> None:
    """Raise if an engine is unknown or was not built.

    Raises:
        UserError: there is no such engine, or the exact one was not built.
    """
    if engine not in ("exact", "gymnasium"):
        raise UserError(f"engine {engine!r}: must be exact or gymnasium")
    if engine == "exact" and not _built:
        raise UserError(
            "engine 'exact': was not built when touchdown was installed; use gymnasium, "
            f"or {installation.how_to_compile()}"
        )


def engine_in_use() -> Engine:
    """The selected engine; by default the exact one, or stock with a warning if it is not built."""
    if _chosen:
        return _chosen[-1]
    if not _built:
        warnings.warn(
            "the exact engine was not built (no C++ compiler when touchdown was installed): "
            "stock Gymnasium is used instead, which is slower",
            stacklevel=2,
        )
    _chosen.append("exact" if _built else "gymnasium")
    return _chosen[-1]
