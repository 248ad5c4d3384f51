"""The lander's observation and action spaces, and its physical state."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from touchdown.core.types import FloatArray
from touchdown.lander.rules import NUM_ACTIONS

if TYPE_CHECKING:  # the engine may not have been built
    from touchdown.lander._engine import Batch

# stock's bounds; positions are in half viewports, see gymnasium's lunar_lander.py
_HIGH = np.array([2.5, 2.5, 10, 10, 2 * np.pi, 10, 1, 1], np.float32)
_LOW = np.array([-2.5, -2.5, -10, -10, -2 * np.pi, -10, 0, 0], np.float32)

_NUM_BODIES = 3
_NUM_CORNERS = 11


def observation_space() -> spaces.Box:
    """Stock's observation space, [8]."""
    return spaces.Box(_LOW, _HIGH)


def action_space(*, continuous: bool) -> spaces.Space[Any]:
    """Stock's action space: four discrete actions, or two throttles."""
    return spaces.Box(-1, +1, (2,), np.float32) if continuous else spaces.Discrete(NUM_ACTIONS)


class LanderStates(NamedTuple):
    """The physical states of N landers; the second axis is hull, leg 0, leg 1."""

    positions: FloatArray
    """[N, 3, 2]: x and y of the origins of the bodies, m."""
    angles: FloatArray
    """[N, 3]: radians, counter-clockwise."""
    velocities: FloatArray
    """[N, 3, 2]: velocities of the centres of mass, m/s."""
    angular_velocities: FloatArray
    """[N, 3]: rad/s."""
    leg_contacts: NDArray[np.bool_]
    """[N, 2]: whether the leg is on the ground, by stock's flag."""
    awake: NDArray[np.bool_]
    """[N]: False once the lander is at rest."""
    engine_powers: FloatArray
    """[N, 2]: throttles of the main and the side engine in the last step; the side engine's is
    negative for stock's action 1 and positive for its action 3."""
    fuel: FloatArray
    """[N]: return points spent on the engines in this episode."""


def read_states(batch: "Batch") -> LanderStates:
    """The physical states of all landers of a batch."""
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
        angular_velocities=bodies[..., 5],
        leg_contacts=leg_contacts,
        awake=awake,
        engine_powers=engines[:, :2],
        fuel=engines[:, 2],
    )


def read_terrain(batch: "Batch", index: int) -> FloatArray:
    """The corners of one lander's ground from left to right, metres, [11, 2]."""
    corners = np.empty((_NUM_CORNERS, 2))
    batch.terrain(index, corners)
    return corners
