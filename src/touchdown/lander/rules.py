"""The lander's constants: ids, variants, time limit, actions, fuel costs, tasks of a batch."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchdown.core.types import Mirror

LANDER_ID = "LunarLander-v3"
EXACT_ID = "touchdown/LunarLander-v3"
VARIANTS: Mapping[str, Mapping[str, Any]] = {
    "touchdown/LunarLanderWindy-v3": {"enable_wind": True},
    "touchdown/LunarLanderMars-v3": {"gravity": -3.71},
    "touchdown/LunarLanderHeavy-v3": {"gravity": -11.9},
}
"""Settings of stock's lander by the id of a variant; gravity is in m/s²."""
LANDER_IDS = (LANDER_ID, *VARIANTS)
MAX_EPISODE_STEPS = 1_000  # Gymnasium's time limit of the lander
SOLVED_RETURN = 200.0  # episode return at which Gymnasium considers the lander solved
OBSERVATION_SIZE = 8
NUM_ACTIONS = 4
MAIN_ENGINE_COST = 0.3  # return points per step, as in gymnasium's lunar_lander.py
SIDE_ENGINE_COST = 0.03
NOTHING, STEP, BEGIN = range(3)  # an environment's task in one call of a batch
IDLE, LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE = range(4)
# left and right: x, its velocity, the angle and its velocity change sign, and the legs swap
MIRROR = Mirror(
    order=(0, 1, 2, 3, 4, 5, 7, 6),
    signs=(-1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0),
    actions=(IDLE, RIGHT_ENGINE, MAIN_ENGINE, LEFT_ENGINE),
)


def is_lander(env_id: str) -> bool:
    """Whether the id is that of the lander with discrete actions, or of one of its variants."""
    return env_id in LANDER_IDS


def settings_of(env_id: str) -> Mapping[str, Any]:
    """The settings of a lander by its id; {} for Gymnasium's own."""
    return VARIANTS.get(env_id, {})


def limit_of(max_episode_steps: int | None) -> int:
    """A time limit in steps; None and Gymnasium's -1 are more than any episode has.

    Raises:
        ValueError: it is neither -1 nor at least 1.
    """
    if max_episode_steps is None or max_episode_steps == -1:
        return int(np.iinfo(np.int64).max)
    if max_episode_steps < 1:
        raise ValueError(
            f"max_episode_steps = {max_episode_steps}: must be at least 1, or -1 for no limit"
        )
    return max_episode_steps


def fuel_of(actions: NDArray[np.integer]) -> float:
    """Return points spent on the engines over an episode's actions [T]."""
    main = np.count_nonzero(actions == MAIN_ENGINE)
    side = np.count_nonzero((actions == LEFT_ENGINE) | (actions == RIGHT_ENGINE))
    return MAIN_ENGINE_COST * main + SIDE_ENGINE_COST * side
