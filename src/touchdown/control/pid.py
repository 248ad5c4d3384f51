"""The paper's PID controller: two control values, a dead band, one engine per step (appendix C)."""

from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np
from msgspec import Meta

from touchdown.config.checks import settle
from touchdown.core.types import FloatArray, IntArray

# the lander's actions, and the indices of its observation, as Gymnasium numbers them
_IDLE, _LEFT, _MAIN, _RIGHT = range(4)
_X, _Y, _VX, _VY, _ANGLE, _ANGULAR_VELOCITY = range(6)

Rule = Literal["absolute", "signed"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PIDConfig:
    """Gains of Eq. 10, the dead band, and the rule that selects the main engine.

    u_vy has the setpoint 0 for the vertical velocity and the height. u_φ has the setpoint x + v_x
    for the angle φ. Eq. 10 uses measurements rather than errors, and Gymnasium measures angles
    counter-clockwise, so the signs are in the gains. Units are those of the observation: positions
    in 10 m (x) and 6.67 m (y), velocities in 5 m/s (x) and 7.5 m/s (y), angles in radians, angular
    velocity in 2.5 rad/s. Control values have no unit.
    """

    rule: Rule
    """`absolute`: the main engine fires if |u_vy| > |u_φ|, as printed. `signed`: if u_vy > |u_φ|,
    because the main engine can only push up."""
    kp_vertical: float
    """kp of u_vy, on the vertical velocity."""
    ki_vertical: float
    """ki of u_vy, on the height, which is the integral of the vertical velocity."""
    kp_angle: float
    """kp of u_φ, on the error x + v_x - φ."""
    kd_angle: float
    """kd of u_φ, on v_x - ω."""
    dead_band: Annotated[float, Meta(ge=0)]
    """η: no engine fires for control values of smaller magnitude."""

    def __post_init__(self) -> None:
        settle(self)


class ControlValues(NamedTuple):
    """The control values u_vy and u_φ of each observation, [N] each."""

    vertical: FloatArray
    angle: FloatArray


def control_values(config: PIDConfig, observations: FloatArray) -> ControlValues:
    """u_vy and u_φ by Eq. 10.

    Args:
        config: the gains.
        observations: [N, 8].
    """
    x, y, vx, vy, angle, angular_velocity = (
        observations[:, i] for i in (_X, _Y, _VX, _VY, _ANGLE, _ANGULAR_VELOCITY)
    )
    return ControlValues(
        vertical=config.kp_vertical * vy + config.ki_vertical * y,
        angle=config.kp_angle * (x + vx - angle) + config.kd_angle * (vx - angular_velocity),
    )


def choose_actions(config: PIDConfig, values: ControlValues) -> IntArray:
    """The action rule: no engine inside the dead band, else that of the larger value, [N]."""
    vertical = np.abs(values.vertical) if config.rule == "absolute" else values.vertical
    rotation = np.abs(values.angle)
    main = (vertical >= config.dead_band) & (vertical > rotation)
    right = ~main & (values.angle > config.dead_band)
    left = ~main & (values.angle < -config.dead_band)
    return np.select([main, right, left], [_MAIN, _RIGHT, _LEFT], _IDLE)


class PIDPolicy:
    """The PID controller as a policy.

    Args:
        config: gains, dead band and rule.
    """

    def __init__(self, config: PIDConfig) -> None:
        self.config = config

    def act(self, observations: FloatArray) -> IntArray:
        """The engine to fire for each observation: [N, 8] to [N]."""
        return choose_actions(self.config, control_values(self.config, observations))
