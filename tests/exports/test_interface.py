import numpy as np
from numpy.testing import assert_allclose

from touchdown.core.types import Spaces
from touchdown.envs import recorder
from touchdown.exports.interface import interface, limits
from touchdown.policies import lookup

LANDER = "LunarLander-v3"


def test_the_lander_is_described_in_the_units_and_directions_that_it_has():
    text = interface(LANDER, Spaces(8, 4))
    for row in ("10 m", "6.67 m", "5 m/s", "7.5 m/s", "1 rad", "2.5 rad/s"):
        assert f"| {row} |" in text
    assert "whether the right and the left leg touch" in text
    ace = lookup.load("ace")
    flight = recorder.record_flight(ace.policy, LANDER, 0, "ace")
    x, y, angle = np.float64(flight.bodies[:, 0]).T
    seen = np.float64(flight.observations)
    terrain = flight.terrain
    middle = (terrain.helipad_x1 + terrain.helipad_x2) / 2
    assert_allclose(10 * seen[:, 0], x - middle, atol=1e-5)
    stands = 18 / 30  # the hull's centre above the pad, in metres
    assert_allclose(20 / 3 * seen[:, 1], y - terrain.helipad_y - stands, atol=1e-5)
    assert_allclose(seen[:, 4], angle, atol=1e-6)
    free = ~seen[1:, 6:].any(axis=1)  # no leg touches the ground, so speed is the way in a step
    way = np.diff(np.stack((x, y, angle)))[:, free] * 50  # metres and radians a second
    assert_allclose(5 * seen[1:, 2][free], way[0], atol=0.1)
    assert_allclose(7.5 * seen[1:, 3][free], way[1], atol=0.1)
    assert_allclose(2.5 * seen[1:, 5][free], way[2], atol=0.1)
    hull, first, second = flight.bodies[0, :, 0]
    assert second < hull < first  # the first leg is the right one


def test_other_environments_are_described_by_their_spaces_and_promise_no_landing():
    cart, lake = Spaces(4, 2), Spaces(16, 4, 16)
    assert "4 numbers; the action is a number from 0 to 1." in interface("CartPole-v1", cart)
    assert "a state, from 0 to 15, as a one-hot vector" in interface("FrozenLake-v1", lake)
    for text in (interface("CartPole-v1", cart), limits("CartPole-v1")):
        assert "CartPole-v1" in text
        assert "wind" not in text
    assert "wind" in limits(LANDER)
