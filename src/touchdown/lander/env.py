"""Making a world, and saying in words how an episode in it ended."""

import importlib.util
import warnings
from typing import Any, Literal, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.wrappers import DtypeObservation, FlattenObservation, TimeLimit

from touchdown.errors import UserError, one_line
from touchdown.types import FloatArray, Outcome, Spaces

LANDER_IDS = ("LunarLander-v3",)
EXACT_ID = "touchdown/LunarLander-v3"
Engine = Literal["exact", "gymnasium"]
MAX_EPISODE_STEPS = 1_000
OBSERVATION_SIZE = 8
MAIN_ENGINE_COST = 0.3  # return points a step, gymnasium's lunar_lander.py
SIDE_ENGINE_COST = 0.03
NOTHING, STEP, BEGIN = range(3)  # what a lander may be told to do in a step of its batch
IDLE, LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE = range(4)

Env = gymnasium.Env[Any, Any]


class World(NamedTuple):
    """An environment and what an agent is told of it."""

    env: Env
    spaces: Spaces


def is_lander(env_id: str) -> bool:
    """Whether the id names the lander with discrete actions."""
    return env_id in LANDER_IDS


_chosen: list[Engine] = []
_built = importlib.util.find_spec("touchdown.lander.engine._engine") is not None


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


def make(
    env_id: str = "LunarLander-v3",
    render_mode: str | None = None,
    engine: Engine = "gymnasium",
) -> World:
    """A Gymnasium environment with a flat Box observation and Discrete actions.

    A Discrete observation is made a Box: one-hot. A world without a time limit is cut off after
    1,000 steps, for a greedy policy may go round in circles for ever.

    Args:
        env_id: Gymnasium's id.
        render_mode: Gymnasium's, `rgb_array` or `human`; for stock alone.
        engine: what flies the lander; other worlds are stock always.

    Raises:
        UserError: there is no such environment, it cannot be made, or its spaces are others.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # gymnasium warns of versions that it then refuses
            if engine == "exact" and is_lander(env_id):
                env = _exact_lander(render_mode)
            else:
                env = gymnasium.make(env_id, render_mode=render_mode, disable_env_checker=True)
    except (gymnasium.error.Error, ImportError, AttributeError, TypeError, ValueError) as error:
        raise UserError(f"env_id {env_id!r}: cannot be made: {one_line(error)}") from None
    if env.spec is not None and env.spec.max_episode_steps is None:
        env = TimeLimit(env, MAX_EPISODE_STEPS)
    num_states = None
    if isinstance(env.observation_space, spaces.Discrete):
        num_states = int(env.observation_space.n)
        env = DtypeObservation(FlattenObservation(env), np.float32)
    observation, action = env.observation_space, env.action_space
    if not isinstance(action, spaces.Discrete):
        env.close()
        raise UserError(
            f"env_id {env_id!r}: its action space is {action}; Q-learning needs Discrete actions"
        )
    if not isinstance(observation, spaces.Box) or len(observation.shape) != 1:
        env.close()
        raise UserError(
            f"env_id {env_id!r}: its observation space is {observation}; "
            "a flat Box (one vector of numbers) or Discrete is needed"
        )
    if action.start != 0:
        env.close()
        raise UserError(f"env_id {env_id!r}: its actions are {action}; they must start at 0")
    sizes = Spaces(
        observation.shape[0],
        int(action.n),
        num_states,
        tuple(observation.low.tolist()),
        tuple(observation.high.tolist()),
        None if num_states is None else getattr(env.unwrapped, "P", None),
    )
    return World(env, sizes)


def _exact_lander(render_mode: str | None) -> Env:
    # where the engine was not built there is nothing to import
    from touchdown.lander.single import LanderEnv  # noqa: PLC0415

    return LanderEnv(render_mode, max_episode_steps=MAX_EPISODE_STEPS)


def outcome_of(env_id: str, observation: FloatArray, reward: float, *, terminated: bool) -> Outcome:
    """How an episode ended, from its last step.

    The lander's last reward is exactly +100 where it came to rest, -100 where it hit or left.
    """
    if not terminated:
        return "timed out"
    if not is_lander(env_id):
        return "terminated"
    if reward == 100:
        return "landed"
    return "out of bounds" if abs(float(observation[0])) >= 1 else "crashed"


def fuel_of(actions: np.ndarray[Any, np.dtype[Any]]) -> float:
    """Return points that the engines cost over a flight's actions [T] of the lander."""
    main = np.count_nonzero(actions == MAIN_ENGINE)
    side = np.count_nonzero((actions == LEFT_ENGINE) | (actions == RIGHT_ENGINE))
    return MAIN_ENGINE_COST * main + SIDE_ENGINE_COST * side
