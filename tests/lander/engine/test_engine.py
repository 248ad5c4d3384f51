"""What the engine promises besides being exact: randomness, snapshots and plain refusals."""

import gymnasium as gym
import numpy as np
import oracle
import pytest

from touchdown.lander.engine import Lander, Pcg64


@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1, 2**32, 2**64 + 3, 2**130 + 7, 3**200])
def test_generator_equals_numpys(seed):
    ours, numpys = Pcg64(seed), np.random.default_rng(seed)
    for _ in range(1000):
        assert ours.uniform(-1.0, 1.0) == numpys.uniform(-1.0, 1.0)
        assert ours.integers(-9999, 9999) == numpys.integers(-9999, 9999)
        assert ours.integers(0, 2**31 + 1) == numpys.integers(0, 2**31 + 1)  # rejects half


def flown(lander, steps, seed):
    rng = np.random.default_rng(seed)
    return [lander.step(int(rng.integers(4))) for _ in range(steps)]


def same(one, other):
    pairs = zip(one, other, strict=True)
    return all(a[0].tobytes() == b[0].tobytes() and a[1:] == b[1:] for a, b in pairs)


@pytest.mark.parametrize("steps_before", [0, 30, 90, 150])  # in flight, falling, on the ground
def test_restored_lander_goes_on_identically_and_over_a_reset(steps_before):
    lander = Lander(enable_wind=True)
    lander.reset(3)
    flown(lander, steps_before, seed=0)
    snapshot = lander.snapshot()
    expected = flown(lander, 100, seed=1), lander.reset(), flown(lander, 100, seed=2)

    fresh = Lander(enable_wind=True)
    fresh.restore(snapshot)
    got = flown(fresh, 100, seed=1), fresh.reset(), flown(fresh, 100, seed=2)
    assert same(expected[0], got[0])
    assert expected[1].tobytes() == got[1].tobytes()
    assert same(expected[2], got[2])


def test_restoring_takes_nothing_from_the_snapshot():
    lander = Lander()
    lander.reset(3)
    snapshot = lander.snapshot()
    first = flown(lander, 50, seed=0)
    lander.restore(snapshot)
    assert same(first, flown(lander, 50, seed=0))


def test_foreign_bytes_are_refused_and_change_nothing():
    lander = Lander()
    lander.reset(3)
    before = lander.snapshot()
    damaged = bytearray(before)
    damaged[len(before) // 2] ^= 1
    newer = bytearray(before)
    newer[8] += 1
    other = Lander(gravity=-3.7)
    other.reset(3)
    for foreign, complaint in {
        b"": "too short",
        b"x" * len(before): "not a snapshot",
        before[:-1]: "damaged",
        before + b"x": "damaged",
        bytes(damaged): "damaged",
        bytes(newer): "another version",
        other.snapshot(): "other settings",
    }.items():
        with pytest.raises(ValueError, match=complaint):
            lander.restore(foreign)
    assert lander.snapshot() == before


@pytest.mark.parametrize("action", [-1, 4, 2**70, 1.5, float("nan"), "2", None, np.zeros(2)])
def test_what_is_no_discrete_action_is_refused(action):
    lander = Lander()
    lander.reset(0)
    with pytest.raises(ValueError, match="a whole number from 0 to 3"):
        lander.step(action)


@pytest.mark.parametrize("action", [2, None, "ab", [1.0], [1.0, 2.0, 3.0], [0.0, float("nan")]])
def test_what_is_no_continuous_action_is_refused(action):
    lander = Lander(continuous=True)
    lander.reset(0)
    with pytest.raises(ValueError, match="a pair of numbers"):
        lander.step(action)
    with pytest.raises(ValueError, match="a pair of numbers"):
        lander.step(np.array([np.nan, 0.0], np.float32))


def test_kinds_of_equal_actions_do_the_same():
    for actions, continuous in [
        ((2, np.int64(2), np.uint8(2)), False),
        (([0.5, -1.0], (0.5, -1), np.array([0.5, -1.0]), np.array([0.5, -1.0], np.float32)), True),
    ]:
        observations = set()
        for action in actions:
            lander = Lander(continuous=continuous)
            lander.reset(0)
            observations.add(lander.step(action)[0].tobytes())
        assert len(observations) == 1


def test_first_step_needs_a_reset():
    with pytest.raises(RuntimeError, match="reset"):
        Lander().step(0)


@pytest.mark.parametrize(
    "settings",
    [{"gravity": 0.0}, {"gravity": -12.0}, {"gravity": np.nan}, {"wind_power": np.inf}],
)
def test_settings_that_stock_refuses_or_that_are_not_finite_are_refused(settings):
    with pytest.raises(ValueError, match=next(iter(settings))):
        Lander(**settings)


def test_a_seed_is_a_whole_number_from_zero():
    with pytest.raises(ValueError, match="seed = -1: must be 0 or more"):
        Lander().reset(-1)
    with pytest.raises(TypeError):
        Lander().reset(1.0)


def test_landers_without_a_seed_differ():
    assert Lander().reset().tobytes() != Lander().reset().tobytes()


def test_engine_powers_are_those_of_the_last_step():
    lander = Lander()
    lander.reset(0)
    powers = []
    for action in range(4):
        lander.step(action)
        powers.append(lander.engine_powers)
    assert powers == [(0.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)]


def test_the_comparison_notices_a_single_bit():
    stock = gym.make("LunarLander-v3", disable_env_checker=True).unwrapped
    engine = Lander()
    stock.reset(seed=0)
    engine.reset(0)
    o, reward, terminated, _, _ = stock.step(0)
    got = engine.step(0)
    assert oracle.difference(stock, engine, (o, reward, terminated), got) is None
    nudged = np.nextafter(o, np.float32(9), dtype=np.float32)
    for expected, name in [
        ((nudged, reward, terminated), "observation"),
        ((o, np.nextafter(reward, 9), terminated), "reward"),
        ((o, reward, not terminated), "terminated"),
    ]:
        assert oracle.difference(stock, engine, expected, got).startswith(name)
