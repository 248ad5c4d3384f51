"""The paper's controller: two control values, a dead band, one engine at a time (appendix C)."""

from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np
from msgspec import Meta

from touchdown.config.checks import settle
from touchdown.core.types import FloatArray, IntArray

# the lander's actions and the places in its observation, as gymnasium numbers them
_IDLE, _LEFT, _MAIN, _RIGHT = range(4)
_X, _Y, _VX, _VY, _ANGLE, _SPIN = range(6)

Rule = Literal["absolute", "signed"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PIDConfig:
    """Gains of Eq. 10, the dead band, and how the vertical control value chooses the main engine.

    Gains carry their signs: Eq. 10 feeds measurements rather than errors, and gymnasium counts
    angles counter-clockwise. Units are the observation's: positions in half viewports (10 m across,
    6.67 m up), velocities in 5 m/s across and 7.5 m/s up, angles in radians, spin in 2.5 rad/s;
    control values have none.
    """

    rule: Rule
    """`absolute`: main engine when |u_vy| > |u_φ|, as printed. `signed`: when u_vy > |u_φ|, since
    the main engine can only push up."""
    kp_vertical: float
    """τ_p of u_vy, on vertical velocity."""
    ki_vertical: float
    """τ_i of u_vy, on height, the integral of vertical velocity."""
    kp_angle: float
    """τ_p of u_φ, on x + v_x - φ."""
    kd_angle: float
    """τ_d of u_φ, on v_x - ω."""
    dead_band: Annotated[float, Meta(ge=0)]
    """η: smaller control values fire no engine."""

    def __post_init__(self) -> None:
        settle(self)


class ControlValues(NamedTuple):
    """u_vy and u_φ of each observation, [N] each."""

    vertical: FloatArray
    angle: FloatArray


def control_values(config: PIDConfig, observations: FloatArray) -> ControlValues:
    """Eq. 10.

    Args:
        config: the gains.
        observations: [N, 8].
    """
    x, y, vx, vy, angle, spin = (observations[:, i] for i in (_X, _Y, _VX, _VY, _ANGLE, _SPIN))
    return ControlValues(
        vertical=config.kp_vertical * vy + config.ki_vertical * y,
        angle=config.kp_angle * (x + vx - angle) + config.kd_angle * (vx - spin),
    )


def choose_actions(config: PIDConfig, values: ControlValues) -> IntArray:
    """The action rule: nothing inside the dead band, else the engine of the larger value."""
    vertical = np.abs(values.vertical) if config.rule == "absolute" else values.vertical
    sideways = np.abs(values.angle)
    main = (vertical >= config.dead_band) & (vertical > sideways)
    right = ~main & (values.angle > config.dead_band)
    left = ~main & (values.angle < -config.dead_band)
    return np.select([main, right, left], [_MAIN, _RIGHT, _LEFT], _IDLE)


class PIDPolicy:
    """Flies the lander by Eq. 10.

    Args:
        config: gains, dead band and rule.
    """

    def __init__(self, config: PIDConfig) -> None:
        self.config = config

    def act(self, observations: FloatArray) -> IntArray:
        """The engine to fire for each observation: [N, 8] to [N]."""
        return choose_actions(self.config, control_values(self.config, observations))
