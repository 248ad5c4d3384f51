"""The lander's numbers: ids, actions, costs, and what a batch of landers can be asked to do."""

import numpy as np
from numpy.typing import NDArray

LANDER_IDS = ("LunarLander-v3",)
EXACT_ID = "touchdown/LunarLander-v3"
MAX_EPISODE_STEPS = 1_000
OBSERVATION_SIZE = 8
MAIN_ENGINE_COST = 0.3  # return points a step, gymnasium's lunar_lander.py
SIDE_ENGINE_COST = 0.03
NOTHING, STEP, BEGIN = range(3)  # what one environment of a batch does in a call
IDLE, LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE = range(4)


def is_lander(env_id: str) -> bool:
    """Whether the id names the lander with discrete actions."""
    return env_id in LANDER_IDS


def fuel_of(actions: NDArray[np.integer]) -> float:
    """Return points that the engines cost over an episode's actions [T]."""
    main = np.count_nonzero(actions == MAIN_ENGINE)
    side = np.count_nonzero((actions == LEFT_ENGINE) | (actions == RIGHT_ENGINE))
    return MAIN_ENGINE_COST * main + SIDE_ENGINE_COST * side
