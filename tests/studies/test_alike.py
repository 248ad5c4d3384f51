from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from touchdown.envs.flight import record_flight
from touchdown.policies import lookup
from touchdown.studies.alike import Likeness, Likenesses, compare_flights, distance

PID = lookup.load("pid")


def flight(points):
    """A flight through these places: x and y of observations."""
    base = record_flight(PID.policy, PID.env_id, 1_000_000, "pid")
    observations = np.zeros((len(points), 8), np.float32)
    observations[:, :2] = points
    steps = len(points) - 1
    return replace(
        base,
        observations=observations,
        actions=base.actions[:steps],
        rewards=base.rewards[:steps],
        bodies=None,
    )


def test_a_flight_is_no_way_from_itself():
    own = flight([(0, 1), (0, 0.5), (0, 0)])
    assert distance(own, own) == 0


def test_the_distance_is_the_mean_over_moments_in_metres():
    # 0, 10 and 20 m apart
    one, other = flight([(0, 0)] * 3), flight([(0, 0), (1, 0), (2, 0)])
    assert_allclose(distance(one, other), 10)
    assert distance(other, one) == distance(one, other)


def test_who_is_down_stays_where_it_is():
    # 0, then 6.67 m three times
    short, long = flight([(0, 1), (0, 0)]), flight([(0, 1), (0, 1), (0, 1), (0, 1)])
    assert_allclose(distance(short, long), 20 / 3 * 3 / 4, rtol=1e-6)


def test_a_pilot_is_as_far_from_the_pid_as_it_flies():
    found = compare_flights({0: PID, 1: lookup.load("random")}, [1_000_000, 1_000_001])
    pid, chance = found.of
    assert pid.to_pid == 0 < pid.to_random
    assert chance.to_random == 0 < chance.to_pid == pid.to_random
    assert pid.to_other_seeds == (pid.to_random,)


def test_the_ratio_is_that_of_the_pid_to_another_seed():
    found = Likenesses((Likeness(0, 3.0, 9.0, (1.0, 2.0)), Likeness(1, 3.0, 9.0, ())), 5)
    assert_allclose(found.values(("to the PID, over to another seed",), "ratio"), [2])
    assert_allclose(found.values(("to random",), "distance"), [9, 9])
