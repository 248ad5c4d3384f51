"""Make lander environments, exact or stock, behind the same Gymnasium interfaces."""

from typing import Any

import gymnasium
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from touchdown.lander.engine import Engine, check_engine, engine_in_use
from touchdown.lander.rules import EXACT_ID, LANDER_ID


def make(*, engine: Engine | None = None, **settings: Any) -> gymnasium.Env[Any, Any]:
    """One lander environment with a time limit of 1000 steps.

    Args:
        engine: `exact` or `gymnasium` (stock); by default `exact` if it was built. Both give
            the same results to the last bit.
        settings: stock's `continuous`, `gravity`, `enable_wind`, `wind_power`, `turbulence_power`,
            and `render_mode`.

    Raises:
        UserError: there is no such engine, or the exact one was not built.
        ValueError: a setting is out of range.
    """
    return gymnasium.make(EXACT_ID if _is_exact(engine) else LANDER_ID, **settings)


def make_vec(
    num_envs: int = 1,
    *,
    engine: Engine | None = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    num_threads: int = 1,
    **settings: Any,
) -> VectorEnv[Any, Any, Any]:
    """A vector environment of landers, each with a time limit of 1000 steps.

    Args:
        num_envs: N.
        engine: as in `make`; stock environments are stepped one after the other.
        autoreset_mode: Gymnasium's autoreset mode.
        num_threads: threads of the exact engine; results do not depend on it.
        settings: as in `make`.

    Raises:
        UserError: there is no such engine, or the exact one was not built.
        ValueError: a number is out of range.
    """
    if _is_exact(engine):
        from touchdown.lander.vector import LanderVectorEnv  # noqa: PLC0415 - if it was built

        return LanderVectorEnv(
            num_envs, autoreset_mode=autoreset_mode, num_threads=num_threads, **settings
        )
    if num_envs < 1:
        raise ValueError(f"num_envs = {num_envs}: must be at least 1")
    envs = [lambda: make(engine="gymnasium", **settings)] * num_envs
    return SyncVectorEnv(envs, autoreset_mode=AutoresetMode(autoreset_mode))


def _is_exact(engine: Engine | None) -> bool:
    if engine is not None:
        check_engine(engine)
    return (engine or engine_in_use()) == "exact"
