from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose

from touchdown.control.pid import (
    ControlValues,
    PIDConfig,
    PIDPolicy,
    Rule,
    choose_actions,
    control_values,
)

IDLE, LEFT, MAIN, RIGHT = range(4)  # gymnasium's numbers
X, Y, VX, VY, ANGLE, ANGULAR_VELOCITY, LEG, OTHER_LEG = range(8)

GAINS = PIDConfig(
    rule="absolute", kp_vertical=2, ki_vertical=10, kp_angle=1, kd_angle=100, dead_band=0.5
)


def actions_of(rule: Rule, vertical: float, angle: float, dead_band: float = 0.5) -> int:
    values = ControlValues(np.array([vertical]), np.array([angle]))
    (action,) = choose_actions(replace(GAINS, rule=rule, dead_band=dead_band), values).tolist()
    return action


# --- Eq. 10 ---


def test_control_values_are_those_of_equation_10():
    observation = np.zeros((1, 8))
    observation[0, [X, Y, VX, VY, ANGLE, ANGULAR_VELOCITY]] = [1, 2, 3, 5, 7, 11]
    observation[0, [LEG, OTHER_LEG]] = 1  # decoys: the contacts of the legs are not used
    values = control_values(GAINS, observation)
    assert_allclose(values.vertical, [30])  # 2·5 + 10·2
    assert_allclose(values.angle, [-803])  # 1·(1 + 3 − 7) + 100·(3 − 11)


@pytest.mark.parametrize(
    ("place", "vertical", "angle"),
    [
        (X, 0, 1),
        (Y, 10, 0),
        (VX, 0, 101),
        (VY, 2, 0),
        (ANGLE, 0, -1),
        (ANGULAR_VELOCITY, 0, -100),
        (LEG, 0, 0),
        (OTHER_LEG, 0, 0),
    ],
)
def test_each_measurement_contributes_with_its_own_gain(place: int, vertical: float, angle: float):
    values = control_values(GAINS, np.eye(8)[[place]])
    assert (values.vertical.item(), values.angle.item()) == (vertical, angle)


# --- the action rule ---


@pytest.mark.parametrize("rule", ["absolute", "signed"])
@pytest.mark.parametrize(
    ("vertical", "angle", "action"),
    [
        (0.49, 0.49, IDLE),  # both within the dead band
        (0.49, -0.49, IDLE),
        (0.49, 0.1, IDLE),  # larger than that of the angle, but within the dead band
        (0.9, 0.8, MAIN),  # both outside: the larger
        (0.9, -0.8, MAIN),
        (0.6, 0.1, MAIN),
        (0.8, 0.9, RIGHT),
        (0.8, -0.9, LEFT),
        (0.7, 0.7, RIGHT),  # equal: not larger
        (0.7, -0.7, LEFT),
        (0.1, 0.6, RIGHT),
        (0.1, -0.6, LEFT),
        (0.0, 0.5, IDLE),  # at the dead band exactly
        (0.0, -0.5, IDLE),
    ],
)
def test_outside_the_dead_band_the_engine_of_the_larger_value_fires(
    rule: Rule, vertical: float, angle: float, action: int
):
    assert actions_of(rule, vertical, angle) == action


@pytest.mark.parametrize(
    ("vertical", "angle", "absolute", "signed"),
    [
        (-0.9, 0.1, MAIN, IDLE),  # rising too fast: as printed, the engine pushes up even more
        (-0.9, 0.8, MAIN, RIGHT),
        (-0.9, -0.8, MAIN, LEFT),
        (-0.8, 0.9, RIGHT, RIGHT),
        (-0.1, 0.0, IDLE, IDLE),
    ],
)
def test_the_rules_differ_where_the_vertical_value_is_negative(
    vertical: float, angle: float, absolute: int, signed: int
):
    assert actions_of("absolute", vertical, angle) == absolute
    assert actions_of("signed", vertical, angle) == signed


def test_a_wider_dead_band_silences_the_engines():
    assert actions_of("absolute", 3, 2, dead_band=2.9) == MAIN
    assert actions_of("absolute", 3, 2, dead_band=3.1) == IDLE
    assert actions_of("absolute", 2, 3, dead_band=2.9) == RIGHT
    assert actions_of("absolute", 2, 3, dead_band=3.1) == IDLE


def test_without_a_dead_band_no_engine_fires_at_rest():
    assert actions_of("absolute", 0.0, 0.0, dead_band=0.0) == IDLE
    assert actions_of("signed", 0.0, 1e-9, dead_band=0.0) == RIGHT


# --- the policy ---


def slow_action(config: PIDConfig, observation: np.ndarray) -> int:
    """The slow twin: the paper's rule for one observation, branch by branch."""
    x, y, vx, vy, angle, angular_velocity, *_ = observation.tolist()
    vertical = config.kp_vertical * vy + config.ki_vertical * y
    rotation = config.kp_angle * (x + vx - angle) + config.kd_angle * (vx - angular_velocity)
    if max(abs(vertical), abs(rotation)) < config.dead_band:
        return IDLE
    up = abs(vertical) if config.rule == "absolute" else vertical
    if up > abs(rotation) and up >= config.dead_band:
        return MAIN
    if rotation > config.dead_band:
        return RIGHT
    return LEFT if rotation < -config.dead_band else IDLE


@pytest.mark.parametrize("rule", ["absolute", "signed"])
def test_a_policy_chooses_the_same_actions_in_a_batch_as_one_by_one(rule: Rule):
    policy = PIDPolicy(replace(GAINS, rule=rule, ki_vertical=-1, kd_angle=-1, dead_band=1.0))
    observations = default_rng(0).normal(size=(400, 8))
    actions = policy.act(observations).tolist()
    assert actions == [slow_action(policy.config, observation) for observation in observations]
    assert set(actions) == {IDLE, LEFT, MAIN, RIGHT}


# --- refusals ---


def test_a_negative_dead_band_is_refused():
    with pytest.raises(ValueError, match=r"dead_band = -0\.1: must be 0 or more"):
        replace(GAINS, dead_band=-0.1)


def test_an_unknown_rule_is_refused():
    with pytest.raises(ValueError, match="rule = 'largest': must be one of absolute, signed"):
        replace(GAINS, rule="largest")
