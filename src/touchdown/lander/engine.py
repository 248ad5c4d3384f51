"""Which engine simulates the lander: the exact one in C++, or stock Gymnasium."""

import importlib.util
import warnings
from typing import Literal

from touchdown.core.errors import UserError

Engine = Literal["exact", "gymnasium"]

_chosen: list[Engine] = []
_built = importlib.util.find_spec("touchdown.lander._engine") is not None


def engine_built() -> bool:
    """Whether the exact engine came with this installation."""
    return _built


def use_engine(engine: Engine) -> None:
    """Choose what flies the lander where either would do; results are the same to the last bit.

    Args:
        engine: `exact`, ours in C++, or `gymnasium`, stock.

    Raises:
        UserError: there is no such engine, or ours was not built.
    """
    check_engine(engine)
    _chosen.append(engine)


def check_engine(engine: Engine) -> None:
    """Refuse an engine that is not there.

    Raises:
        UserError: there is no such engine, or ours was not built.
    """
    if engine not in ("exact", "gymnasium"):
        raise UserError(f"engine {engine!r}: must be exact or gymnasium")
    if engine == "exact" and not _built:
        raise UserError(
            "engine 'exact': was not built when touchdown was installed; "
            "install a C++ compiler such as g++ and then touchdown again, or take gymnasium"
        )


def engine_in_use() -> Engine:
    """Ours where it was built, unless stock was chosen; without it, once a word of warning."""
    if _chosen:
        return _chosen[-1]
    if not _built:
        warnings.warn(
            "the exact engine was not built (no C++ compiler when touchdown was installed): "
            "stock Gymnasium flies instead, more slowly",
            stacklevel=2,
        )
    _chosen.append("exact" if _built else "gymnasium")
    return _chosen[-1]
