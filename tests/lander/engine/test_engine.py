"""The engine beyond exactness: random numbers, snapshots, and errors."""

from pathlib import Path
from threading import Event, Thread

import gymnasium as gym
import numpy as np
import oracle
import pytest

from touchdown.lander._engine import Batch, Pcg64
from touchdown.lander.rules import BEGIN, STEP
from touchdown.lander.single import LanderEnv
from touchdown.lander.space import read_states


@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1, 2**32, 2**64 + 3, 2**130 + 7, 3**200])
def test_generator_equals_numpys(seed):
    ours, numpys = Pcg64(seed), np.random.default_rng(seed)
    for _ in range(1000):
        assert ours.uniform(-1.0, 1.0) == numpys.uniform(-1.0, 1.0)
        assert ours.integers(-9999, 9999) == numpys.integers(-9999, 9999)
        assert ours.integers(0, 2**31 + 1) == numpys.integers(0, 2**31 + 1)  # rejects half


def flown(lander, steps, seed):
    rng = np.random.default_rng(seed)
    return [lander.step(int(rng.integers(4)))[:3] for _ in range(steps)]


def same(one, other):
    pairs = zip(one, other, strict=True)
    return all(a[0].tobytes() == b[0].tobytes() and a[1:] == b[1:] for a, b in pairs)


@pytest.mark.parametrize("steps_before", [0, 30, 90, 150])  # in flight, falling, on the ground
def test_restored_lander_continues_identically_and_through_a_reset(steps_before):
    lander = LanderEnv(enable_wind=True)
    lander.reset(seed=3)
    flown(lander, steps_before, seed=0)
    snapshot = lander.snapshot()
    expected = flown(lander, 100, seed=1), lander.reset()[0], flown(lander, 100, seed=2)

    fresh = LanderEnv(enable_wind=True)
    fresh.restore(snapshot)
    got = flown(fresh, 100, seed=1), fresh.reset()[0], flown(fresh, 100, seed=2)
    assert same(expected[0], got[0])
    assert expected[1].tobytes() == got[1].tobytes()
    assert same(expected[2], got[2])


def test_a_snapshot_can_be_restored_twice():
    lander = LanderEnv()
    lander.reset(seed=3)
    snapshot = lander.snapshot()
    first = flown(lander, 50, seed=0)
    lander.restore(snapshot)
    assert same(first, flown(lander, 50, seed=0))


def test_foreign_bytes_are_refused_and_change_nothing():
    lander = LanderEnv()
    lander.reset(seed=3)
    before = lander.snapshot()
    damaged = bytearray(before)
    damaged[len(before) // 2] ^= 1
    newer = bytearray(before)
    newer[8] += 1
    other = LanderEnv(gravity=-3.7)
    other.reset(seed=3)
    for foreign, complaint in {
        b"": "not a snapshot",
        before[:20]: "damaged",
        b"x" * len(before): "not a snapshot",
        before[:-1]: "damaged",
        before + b"x": "damaged",
        bytes(damaged): "damaged",
        bytes(newer): "version 3: must be 2",
        other.snapshot(): "other settings",
    }.items():
        with pytest.raises(ValueError, match=complaint):
            lander.restore(foreign)
    assert lander.snapshot() == before


@pytest.mark.parametrize("action", [-1, 4, 2**70, 1.5, float("nan"), "2", None, np.zeros(2)])
def test_an_invalid_discrete_action_is_refused(action):
    lander = LanderEnv()
    lander.reset(seed=0)
    with pytest.raises(ValueError, match="a whole number from 0 to 3"):
        lander.step(action)


@pytest.mark.parametrize("action", [2, None, "ab", [1.0], [1.0, 2.0, 3.0], [[1.0, 2.0]], [1j, 0]])
def test_an_invalid_continuous_action_is_refused(action):
    lander = LanderEnv(continuous=True)
    lander.reset(seed=0)
    with pytest.raises(ValueError, match="a pair of numbers"):
        lander.step(action)
    with pytest.raises(ValueError, match="not a number"):
        lander.step(np.array([np.nan, 0.0], np.float32))


def test_equal_actions_of_different_types_do_the_same():
    for actions, continuous in [
        ((2, np.int64(2), np.uint8(2)), False),
        (([0.5, -1.0], (0.5, -1), np.array([0.5, -1.0]), np.array([0.5, -1.0], np.float32)), True),
    ]:
        observations = set()
        for action in actions:
            lander = LanderEnv(continuous=continuous)
            lander.reset(seed=0)
            observations.add(lander.step(action)[0].tobytes())
        assert len(observations) == 1


def test_first_step_needs_a_reset():
    with pytest.raises(RuntimeError, match="reset"):
        LanderEnv().step(0)


@pytest.mark.parametrize(
    "settings",
    [{"gravity": 0.0}, {"gravity": -12.0}, {"gravity": np.nan}, {"wind_power": np.inf}],
)
def test_settings_that_stock_refuses_or_that_are_not_finite_are_refused(settings):
    with pytest.raises(ValueError, match=next(iter(settings))):
        LanderEnv(**settings)


def test_a_seed_is_a_whole_number_from_zero():
    with pytest.raises(ValueError, match="seed = -1: must be 0 or more"):
        Batch(1).seed(0, -1)
    with pytest.raises(TypeError):
        Batch(1).seed(0, 1.5)


def test_landers_without_a_seed_differ():
    assert LanderEnv().reset()[0].tobytes() != LanderEnv().reset()[0].tobytes()


def test_states_hold_the_engine_powers_and_the_fuel():
    lander = LanderEnv()
    lander.reset(seed=0)
    powers, fuel = [], []
    for action in range(4):
        lander.step(action)
        states = lander.states()
        powers.append(tuple(states.engine_powers[0].tolist()))
        fuel.append(float(states.fuel[0]))
    assert powers == [(0.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)]
    np.testing.assert_allclose(fuel, [0.0, 0.03, 0.33, 0.36])
    lander.reset()
    assert lander.states().fuel[0] == 0.0


def test_the_comparison_notices_a_single_bit():
    stock = gym.make("LunarLander-v3", disable_env_checker=True).unwrapped
    stock.reset(seed=0)
    o, reward, terminated, _, _ = stock.step(0)
    batch = Batch(1)
    batch.seed(0, 0)
    observations, rewards = np.zeros((1, 8), np.float32), np.zeros(1)
    ended = np.zeros(1, np.bool_)
    for task in (BEGIN, STEP):
        batch.step(np.zeros(1, np.int64), observations, rewards, ended, np.array([task], np.uint8))
    got = observations[0], rewards[0], ended[0]

    def found(expected, nudge=None):
        states = read_states(batch)
        if nudge is not None:
            values = getattr(states, nudge)
            values.flat[0] = np.nextafter(values.flat[0], np.float32(9), dtype=np.float32)
        return oracle.difference(stock, expected, got, states, 0)

    assert found((o, reward, terminated)) is None
    nudged = np.nextafter(o, np.float32(9), dtype=np.float32)
    assert found((nudged, reward, terminated)).startswith("observation")
    assert found((o, np.nextafter(reward, 9), terminated)).startswith("reward")
    assert found((o, reward, not terminated)).startswith("terminated")
    for name in ("positions", "angles", "velocities", "angular_velocities"):
        assert found((o, reward, terminated), nudge=name).startswith(name)


def test_arrays_that_a_batch_cannot_write_are_refused():
    batch = Batch(2)
    good = np.zeros(2, np.int64), np.zeros((2, 8), np.float32), np.zeros(2), np.zeros(2, np.bool_)
    batch.step(*good, np.full(2, BEGIN, np.uint8))
    with pytest.raises(ValueError, match="observations has 3 rows, must have 2"):
        batch.step(good[0], np.zeros((3, 8), np.float32), *good[2:])
    with pytest.raises(ValueError, match=r"tasks\[1\] = 3: must be 0 \(nothing\)"):
        batch.step(*good, np.array([1, 3], np.uint8))
    for wrong in (np.zeros((2, 8)), np.zeros((2, 16), np.float32)[:, ::2]):
        with pytest.raises(TypeError):
            batch.step(good[0], wrong, *good[2:])


def test_a_refused_step_changes_no_environment():
    batch = Batch(2)
    results = np.zeros((2, 8), np.float32), np.zeros(2), np.zeros(2, np.bool_)
    batch.step(np.zeros(2, np.int64), *results, np.array([BEGIN, 0], np.uint8))
    before = batch.snapshot(0)
    with pytest.raises(RuntimeError, match="reset environment 1"):
        batch.step(np.zeros(2, np.int64), *results)
    with pytest.raises(ValueError, match=r"actions\[0\] = 9"):
        batch.step(np.array([9, 0]), *results, np.array([STEP, 0], np.uint8))
    assert batch.snapshot(0) == before


def test_copying_to_an_index_out_of_range_changes_no_environment():
    batch = Batch(3)
    results = np.zeros((3, 8), np.float32), np.zeros(3), np.zeros(3, np.bool_)
    batch.step(np.zeros(3, np.int64), *results, np.full(3, BEGIN, np.uint8))
    before = [batch.snapshot(i) for i in range(3)]
    with pytest.raises(IndexError, match="index 3: must be from 0 to 2"):
        batch.copy(0, [1, 3])
    assert [batch.snapshot(i) for i in range(3)] == before


def test_landers_that_another_thread_is_stepping_are_left_alone():
    batch = Batch(4_000)
    results = np.zeros((4_000, 8), np.float32), np.zeros(4_000), np.zeros(4_000, np.bool_)
    for i in range(4_000):
        batch.seed(i, i)
    batch.step(np.zeros(4_000, np.int64), *results, np.full(4_000, BEGIN, np.uint8))
    over = Event()

    def fly() -> None:
        while not over.is_set():
            batch.step(np.zeros(4_000, np.int64), *results)

    def look() -> None:
        for _ in range(1_000_000):
            batch.snapshot(0)

    stepping = Thread(target=fly)
    stepping.start()
    try:
        with pytest.raises(RuntimeError, match="another thread is stepping these landers"):
            look()
    finally:
        over.set()
        stepping.join()
    assert len(batch.snapshot(0)) > 0


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux")
def test_threads_do_not_leak_memory():
    batch = Batch(65, num_threads=2)
    results = np.zeros((65, 8), np.float32), np.zeros(65), np.zeros(65, np.bool_)
    rng = np.random.default_rng(0)
    tasks = np.full(65, BEGIN, np.uint8)

    def fly(steps: int) -> int:
        for _ in range(steps):
            batch.step(rng.integers(0, 4, 65), *results, tasks)
            tasks[:] = np.where(results[2], BEGIN, STEP)
        return int(Path("/proc/self/statm").read_text().split()[1])

    before = fly(300)
    assert fly(1_200) - before < 2_000  # pages; a leak once took 30,000


def test_actions_of_the_other_kind_are_refused():
    results = np.zeros((1, 8), np.float32), np.zeros(1), np.zeros(1, np.bool_)
    begin = np.array([BEGIN], np.uint8)
    with pytest.raises(ValueError, match="these landers take pairs"):
        Batch(1, continuous=True).step(np.zeros(1, np.int64), *results, begin)
    with pytest.raises(ValueError, match="these landers take whole numbers"):
        Batch(1).step(np.zeros((1, 2), np.float32), *results, begin)
