"""Landers that are copied, pickled, forked, or used by two threads at once."""

import copy
import multiprocessing
import os
import pickle
import threading
import warnings
from collections.abc import Callable
from operator import methodcaller
from typing import Any

import cloudpickle
import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode

import touchdown.lander
from touchdown.lander.single import LanderEnv
from touchdown.lander.snapshots import seal
from touchdown.lander.vector import LanderVectorEnv, StepArrays

WINDY = {"continuous": True, "enable_wind": True, "gravity": -6.0}
COPIES = {
    "pickle": lambda env: pickle.loads(pickle.dumps(env)),  # noqa: S301 - our own
    "cloudpickle": lambda env: pickle.loads(cloudpickle.dumps(env)),  # noqa: S301 - our own
    "deepcopy": copy.deepcopy,
    "copy": copy.copy,
}


def flown(env: Any, steps: int, count: int | None = None) -> list[Any]:
    """What some steps return, in an episode after the other."""
    env.action_space.seed(5)
    seen = []
    for _ in range(steps):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        seen.append([np.asarray(each).tobytes() for each in (observation, reward, terminated)])
        if count is None and (terminated or truncated):
            seen.append(env.reset()[0].tobytes())
    return seen


@pytest.mark.parametrize("settings", [{}, WINDY], ids=["discrete", "continuous with wind"])
@pytest.mark.parametrize("copied", [*COPIES][:3])
def test_a_copy_of_one_lander_flies_on_as_the_original(copied: str, settings: dict):
    env = gymnasium.make("touchdown/LunarLander-v3", **settings)
    env.reset(seed=3)
    flown(env, 40)
    twin, inner = COPIES[copied](env), copy.copy(env.unwrapped)
    before = flown(env, 150)  # beyond the end of an episode: the random stream goes on, too
    assert flown(twin, 150) == flown(inner, 150) == before
    assert twin.spec == env.spec


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_a_copy_of_many_landers_flies_on_as_the_original(copied: Callable, mode: AutoresetMode):
    env = LanderVectorEnv(5, autoreset_mode=mode, max_episode_steps=60, num_threads=2, **WINDY)
    env.reset(seed=3)
    flown(env, 40, 5)
    twin = copied(env)
    steps = 10 if mode == AutoresetMode.DISABLED else 100
    assert flown(twin, steps, 5) == flown(env, steps, 5)


@pytest.mark.parametrize("make", [LanderEnv, LanderVectorEnv])
def test_a_copy_before_the_first_reset_begins_as_the_original(make):
    env = make()
    twin = pickle.loads(pickle.dumps(env))  # noqa: S301 - our own
    assert twin.reset(seed=4)[0].tobytes() == env.reset(seed=4)[0].tobytes()
    env.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        copy.deepcopy(env).reset()


def test_a_lander_beyond_its_time_limit_is_copied_too():
    env = LanderEnv(max_episode_steps=2)
    env.reset(seed=0)
    assert [env.step(0)[3] for _ in range(4)] == [False, True, True, True]
    assert copy.deepcopy(env).step(0)[0].tobytes() == env.step(0)[0].tobytes()


def test_a_pickle_with_a_damaged_snapshot_is_refused():
    env = LanderVectorEnv(2)
    env.reset(seed=0)
    state = env.__getstate__()
    state["snapshots"][1] = state["snapshots"][1][:-1] + b"\x99"
    with pytest.raises(ValueError, match="the snapshot is damaged"):
        LanderVectorEnv.__new__(LanderVectorEnv).__setstate__(state)


@pytest.mark.parametrize("make", [LanderEnv, LanderVectorEnv])
def test_a_snapshot_of_which_any_byte_is_changed_is_refused(make):
    env = make()
    env.reset(seed=1)
    index = () if make is LanderEnv else (0,)
    good = env.snapshot(*index)
    for place in range(len(good)):
        damaged = bytearray(good)
        damaged[place] ^= 1 + place % 255
        with pytest.raises(ValueError, match=r"snapshot"):
            env.restore(*index, bytes(damaged))
    env.restore(*index, good)
    assert env.snapshot(*index) == good


def test_a_snapshot_of_one_is_none_of_many():
    one, many = LanderEnv(), LanderVectorEnv()
    for env in (one, many):
        env.reset(seed=0)
    with pytest.raises(ValueError, match="not a snapshot of such a lander"):
        many.restore(0, one.snapshot())
    limited = LanderVectorEnv(max_episode_steps=5)
    many._steps[0] = 6
    with pytest.raises(ValueError, match="has 6 steps, must be from 0 to 5"):
        limited.restore(0, many.snapshot(0))
    for env, index, magic in ((one, (), b"TDSINGLE"), (many, (0,), b"TDVECTOR")):
        with pytest.raises(ValueError, match="the snapshot is damaged"):
            env.restore(*index, seal(magic, b"short"))


def _first_steps(env: Any) -> list[Any]:
    return flown(env, 20)


def test_a_lander_is_handed_to_a_forked_process():
    env = touchdown.lander.make()
    env.reset(seed=7)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python warns of forks in a process with threads
        with multiprocessing.get_context("fork").Pool(1) as pool:
            flown_there = pool.apply(_first_steps, (env,))
    assert flown_there == flown(env, 20)


@pytest.mark.slow  # a new process imports everything again
def test_a_lander_is_handed_to_a_spawned_process():
    env = touchdown.lander.make()
    env.reset(seed=7)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        # this module's functions could not be imported there
        observation, reward, *_ = pool.apply(methodcaller("step", 2), (env,))
    expected = env.step(2)
    np.testing.assert_array_equal(observation, expected[0])
    assert reward == expected[1]


def test_asynchronous_landers_fly_as_ours_do():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python warns of forks in a process with threads
        theirs = AsyncVectorEnv([touchdown.lander.make] * 2, context="fork")
    ours = LanderVectorEnv(2)
    assert theirs.reset(seed=2)[0].tobytes() == ours.reset(seed=2)[0].tobytes()
    for _ in range(20):
        mine, others = ours.step(np.array([2, 3])), theirs.step(np.array([2, 3]))
        assert [a.tobytes() for a in mine[:4]] == [b.tobytes() for b in others[:4]]
    theirs.close()


def in_a_fork(work: Callable[[], object]) -> str:
    """What a forked child says of its work: "" or its error."""
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python warns of forks in a process with threads
        child = os.fork()
    if child == 0:
        said = ""
        try:
            work()
        except BaseException as error:  # noqa: BLE001 - the parent looks at it
            said = f"{type(error).__name__}: {error}"
        os.write(writing, said.encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as file:
        said = file.read()
    os.waitpid(child, 0)
    return said


class Held:
    """Another thread inside a step of an environment, held there until the end of the block."""

    def __init__(self, env: Any) -> None:
        self._env = env
        self._inside, self._go_on = threading.Event(), threading.Event()

    def __enter__(self) -> None:
        def stay() -> None:
            with self._env._turn:
                self._inside.set()
                self._go_on.wait()

        self._thread = threading.Thread(target=stay)
        self._thread.start()
        self._inside.wait()

    def __exit__(self, *_: object) -> None:
        self._go_on.set()
        self._thread.join()


@pytest.mark.parametrize("make", [LanderEnv, lambda: LanderVectorEnv(2)], ids=["one", "many"])
def test_a_second_thread_is_refused_in_one_line_and_so_is_a_fork_of_it(make):
    env = make()
    env.reset(seed=0)
    action = env.action_space.sample()
    index = (0,) if isinstance(env, LanderVectorEnv) else ()
    good = env.snapshot(*index)
    calls = [
        env.reset,
        lambda: env.step(action),
        lambda: env.snapshot(*index),
        lambda: env.restore(*index, good),
        lambda: pickle.dumps(env),
    ]
    with Held(env):
        for call in calls:
            with pytest.raises(RuntimeError, match="another thread is using this environment"):
                call()
        said = in_a_fork(lambda: env.step(action))
        assert said.startswith("RuntimeError: this process was forked while another thread used")
    env.step(action)
    assert in_a_fork(lambda: env.step(action)) == ""


def test_two_threads_at_once_step_or_are_refused():
    env = LanderVectorEnv(64, num_threads=2)
    env.reset(seed=0)
    twin = copy.deepcopy(env)
    steps, refused = [], []

    def work() -> None:
        out = StepArrays.empty(64)
        for _ in range(60):
            try:
                env.step(np.full(64, 2), out=out)
                steps.append(out.observations.tobytes())
            except RuntimeError as error:
                refused.append(str(error))

    threads = [threading.Thread(target=work) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(steps) + len(refused) == 180
    assert set(refused) <= {"another thread is using this environment: give each thread its own"}
    # each step was whole: together they are the flight of one thread
    alone = [twin.step(np.full(64, 2))[0].tobytes() for _ in steps]
    assert sorted(alone) == sorted(steps)


@pytest.mark.parametrize("num_threads", [1, 2])
def test_after_a_fork_between_steps_parent_and_child_fly_on_alike(num_threads):
    env = LanderVectorEnv(64, num_threads=num_threads)
    env.reset(seed=0)
    env.step(np.full(64, 2))
    steps = np.full(64, 1)
    expected = copy.deepcopy(env).step(steps)[0].tobytes()

    def child() -> None:
        assert env.step(steps)[0].tobytes() == expected

    assert in_a_fork(child) == ""
    assert env.step(steps)[0].tobytes() == expected
