"""The lander's spaces and its insides, for one and for many."""

from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from touchdown.core.types import FloatArray
from touchdown.lander._engine import Batch

# as stock's: the observation's units are half viewports, and so on; see gymnasium's lunar_lander.py
_HIGH = np.array([2.5, 2.5, 10, 10, 2 * np.pi, 10, 1, 1], np.float32)
_LOW = np.array([-2.5, -2.5, -10, -10, -2 * np.pi, -10, 0, 0], np.float32)

_NUM_BODIES = 3
_NUM_CORNERS = 11


def observation_space() -> spaces.Box:
    """Stock's."""
    return spaces.Box(_LOW, _HIGH)


def action_space(*, continuous: bool) -> spaces.Space[Any]:
    """Stock's."""
    return spaces.Box(-1, +1, (2,), np.float32) if continuous else spaces.Discrete(4)


class LanderStates(NamedTuple):
    """The insides of N landers; along the second axis of the bodies hull, leg 0 and leg 1."""

    positions: FloatArray
    """[N, 3, 2]: x and y of the bodies' origins, m."""
    angles: FloatArray
    """[N, 3]: radians, counter-clockwise."""
    velocities: FloatArray
    """[N, 3, 2]: of the centres of mass, m/s."""
    spins: FloatArray
    """[N, 3]: radians a second."""
    leg_contacts: NDArray[np.bool_]
    """[N, 2]: whether stock says that the leg is on the ground."""
    awake: NDArray[np.bool_]
    """[N]: false once the lander has come to rest."""
    engine_powers: FloatArray
    """[N, 2]: throttle of the main and of the side engine in the last step; of the side engine,
    less than 0 for stock's action 1 and more for its action 3."""
    fuel: FloatArray
    """[N]: return points that the engines have cost in this episode."""


def read_states(batch: Batch) -> LanderStates:
    """The insides of all landers of a batch."""
    count = len(batch)
    bodies = np.empty((count, _NUM_BODIES, 6), np.float32)
    leg_contacts = np.empty((count, 2), np.bool_)
    awake = np.empty(count, np.bool_)
    engines = np.empty((count, 3))
    batch.states(bodies, leg_contacts, awake, engines)
    return LanderStates(
        positions=bodies[..., 0:2],
        angles=bodies[..., 2],
        velocities=bodies[..., 3:5],
        spins=bodies[..., 5],
        leg_contacts=leg_contacts,
        awake=awake,
        engine_powers=engines[:, :2],
        fuel=engines[:, 2],
    )


def read_terrain(batch: Batch, index: int) -> FloatArray:
    """The corners of one lander's ground from left to right, metres, [11, 2]."""
    corners = np.empty((_NUM_CORNERS, 2))
    batch.terrain(index, corners)
    return corners
