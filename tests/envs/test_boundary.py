"""What an environment of others returns is checked, converted and copied at the border."""

from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from stepping import Always
from touchdown.core import plugins
from touchdown.core.errors import UserError
from touchdown.envs import custom, environment
from touchdown.envs.boundary import Boundary
from touchdown.envs.frames import Frames, NotDrawable
from touchdown.envs.pool import make_pool
from touchdown.envs.recorder import record_flight
from touchdown.evaluation.evaluator import Evaluator
from touchdown.testing import Chain

GOOD = (np.zeros(2, np.float32), 1.0, False, False, {})


class Scripted(gymnasium.Env):
    """Gives what it is told to; an exception is raised."""

    observation_space = spaces.Box(-9, 9, (2,), np.float32)
    action_space = spaces.Discrete(2)

    def __init__(self, step: Any = GOOD, reset: Any = (GOOD[0], {})):
        self.given = {"step": step, "reset": reset}

    def _give(self, what: str) -> Any:
        given = self.given[what]
        if isinstance(given, BaseException):
            raise given
        return given

    def reset(self, **_):
        return self._give("reset")

    def step(self, _):
        return self._give("step")


def changed(**parts: Any) -> tuple:
    names = ("observation", "reward", "terminated", "truncated", "info")
    return tuple(parts.get(name, good) for name, good in zip(names, GOOD, strict=True))


class Spiteful:
    def __repr__(self) -> str:
        raise RuntimeError

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (changed(reward=float("nan")), "returned reward = nan, must be a finite number"),
        (changed(reward=None), "returned reward = None, must be a finite number"),
        (changed(reward="1"), "returned reward = '1', must be a finite number"),
        (changed(reward=np.ones(2)), r"returned reward = array\(.*\), must be a finite number"),
        (changed(reward=1j), "returned reward = 1j, must be a finite number"),
        (changed(observation=np.array([0, np.nan])), "returned observation = .*, must be finite"),
        (changed(observation=np.array([1e300, 0])), "returned observation = .*, must be finite"),
        (changed(observation=np.zeros(3)), r"returned observation = .*, must be float32\(2,\)"),
        (changed(observation=["a", "b"]), r"returned observation = .*, must be float32\(2,\)"),
        (changed(observation=None), r"returned observation = None, must be float32\(2,\)"),
        (
            changed(observation=Spiteful()),
            "returned observation = an object whose repr raised RuntimeError",
        ),
        (changed(terminated=None), "returned terminated = None, must be True or False"),
        (changed(truncated=np.zeros(2, bool)), "returned truncated = .*, must be True or False"),
        (changed(info=None), "returned info = None, must be a dict"),
        (GOOD[:4], "returned 4 values, must be a tuple of 5"),
        (None, "returned one value, must be a tuple of 5"),
        (ConnectionResetError(104, "reset by peer"), "raised ConnectionResetError: reset by peer"),
        (KeyError("wing"), "raised KeyError: 'wing'"),
        (AssertionError(), "raised AssertionError$"),
        (RuntimeError("two\nlines"), "raised RuntimeError: two lines"),
    ],
)
def test_a_step_that_breaks_the_rules_is_one_line_with_its_number(step, said):
    env = Boundary(Scripted(), "Odd-v0")
    env.reset(seed=0)
    env.step(0)
    env.unwrapped.given["step"] = step
    with pytest.raises(UserError, match=rf"^environment Odd-v0: step 2 {said}") as refused:
        env.step(0)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 200


@pytest.mark.parametrize(
    ("reset", "said"),
    [
        (np.zeros(2), "returned one value, must be a tuple of 2"),
        ((np.zeros(2), None), "returned info = None, must be a dict"),
        ((np.array([np.inf, 0]), {}), "returned observation = .*, must be finite"),
        (OSError("no simulator"), "raised OSError: no simulator"),
    ],
)
def test_a_reset_that_breaks_the_rules_is_one_line(reset, said):
    with pytest.raises(UserError, match=rf"^environment Odd-v0: reset {said}"):
        Boundary(Scripted(reset=reset), "Odd-v0").reset(seed=0)


@pytest.mark.parametrize(
    "step",
    [
        changed(reward=1),
        changed(reward=np.float32(1)),
        changed(reward=np.ones(1)),
        changed(reward=[True]),
        changed(terminated=np.zeros((), np.bool_), truncated=np.zeros(1, np.bool_)),
        changed(terminated=0, truncated=np.False_),
        changed(observation=[0, 0]),
        changed(observation=np.zeros(2, np.int8)),
    ],
)
def test_a_value_in_another_form_is_converted(step):
    env = Boundary(Scripted(step), "Odd-v0")
    env.reset(seed=0)
    observation, reward, terminated, truncated, _ = env.step(0)
    assert observation.dtype == np.float32
    assert observation.tolist() == [0, 0]
    assert (type(reward), reward) == (float, 1.0)
    assert terminated is truncated is False


def test_fractions_are_no_whole_numbers():
    env = Scripted((np.array([0.5, 0]), 0.0, False, False, {}))
    env.observation_space = spaces.Box(0, 9, (2,), np.uint8)
    with pytest.raises(UserError, match=r"must be uint8\(2,\)"):
        Boundary(env, "Odd-v0").step(0)


@pytest.mark.parametrize("state", [3, -1, 0.5, None, "a"])
def test_a_state_outside_the_space_is_refused(state):
    env = Scripted(changed(observation=state))
    env.observation_space = spaces.Discrete(3)
    with pytest.raises(UserError, match="must be a whole number from 0 to 2"):
        Boundary(env, "Odd-v0").step(0)


class Reused(Chain):
    """Writes every observation into the same array."""

    def __init__(self):
        super().__init__()
        self._array = np.zeros(5, np.float32)

    def see(self, state):
        self._array[:] = super().see(state)
        return self._array


def test_an_environment_may_reuse_its_array():
    name = custom.name_of(Reused)
    flight = record_flight(Always(1), name, 0, "right", drawn=False)
    assert flight.observations.argmax(axis=1).tolist() == [0, 1, 2, 3, 4, 4]


def refuses_to_close() -> gymnasium.Env:
    class Stubborn(Chain):
        def close(self):
            raise RuntimeError("reset me first")

    return Stubborn()


def test_an_environment_that_cannot_close_is_used_all_the_same():
    name = custom.name_of(refuses_to_close)
    assert environment.spaces_of(name).num_actions == 2
    evaluator = Evaluator(name, 2)
    (result,) = evaluator.rollout(Always(1), [0])
    evaluator.close()
    assert result.episode_return == Chain.GOAL


@pytest.mark.parametrize("error", [RuntimeError, KeyError, AssertionError, OSError])
def test_a_constructor_that_raises_is_one_line(error):
    class Broken(Chain):
        def __init__(self):
            raise error("no fuel")

    gymnasium.register("Broken-v0", Broken)
    try:
        with pytest.raises(UserError, match=f"'Broken-v0': cannot be made: {error.__name__}: '?no"):
            environment.make_env("Broken-v0")
    finally:
        gymnasium.registry.pop("Broken-v0")


class Bare(Chain):
    """Its constructor takes no render mode."""


class Drawn(Chain):
    """Draws what it is told to."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 0.5}  # noqa: RUF012
    picture: Any = np.zeros((4, 6, 3), np.uint8)

    def __init__(self, render_mode=None):
        super().__init__()
        self.render_mode = render_mode

    def render(self):
        if isinstance(self.picture, Exception):
            raise self.picture
        return self.picture


@pytest.fixture
def registered(monkeypatch):
    gymnasium.register("Bare-v0", Bare)
    gymnasium.register("Drawn-v0", Drawn)
    monkeypatch.setattr(Drawn, "picture", Drawn.picture)
    yield
    gymnasium.registry.pop("Bare-v0")
    gymnasium.registry.pop("Drawn-v0")


@pytest.mark.usefixtures("registered")
def test_a_render_mode_is_passed_only_where_a_picture_is_wanted():
    pool = make_pool("Bare-v0", 1, "gymnasium")
    assert pool.reset(0, 0).tolist() == [1, 0, 0, 0, 0]
    assert record_flight(Always(1), "Bare-v0", 0, "right", drawn=False).frames is None
    with pytest.raises(NotDrawable, match=r"'Bare-v0'.*unexpected keyword argument 'render_mode'"):
        record_flight(Always(1), "Bare-v0", 0, "right")


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(
    ("picture", "said"),
    [
        (None, r"render\(\) returned None, must be a picture, uint8\(height, width, 3\)"),
        ("..o..", r"render\(\) returned '..o..', must be a picture"),
        ([np.zeros((4, 6, 3), np.uint8)], r"render\(\) returned \[array"),
        (np.zeros((4, 6, 3)), r"render\(\) returned float64\(4, 6, 3\), must be a picture"),
        (RuntimeError("no GL"), "reset raised RuntimeError: no GL"),
    ],
)
def test_what_is_no_picture_is_named(picture, said):
    Drawn.picture = picture
    with pytest.raises(NotDrawable, match=rf"^environment Drawn-v0: {said}"):
        record_flight(Always(1), "Drawn-v0", 0, "right")


@pytest.mark.usefixtures("registered")
def test_a_frame_rate_below_one_is_kept():
    assert record_flight(Always(1), "Drawn-v0", 0, "right").steps_per_second == 0.5


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("fps", [None, 0, -3, float("nan"), "fast"])
def test_a_frame_rate_that_makes_no_sense_is_the_usual_one(fps, monkeypatch):
    monkeypatch.setattr(Drawn, "metadata", {"render_modes": ["rgb_array"], "render_fps": fps})
    assert record_flight(Always(1), "Drawn-v0", 0, "right").steps_per_second == 50


@pytest.mark.usefixtures("registered")
def test_pictures_of_a_long_episode_are_thinned_to_a_limit():
    env = environment.make_env("Drawn-v0", render_mode="rgb_array").env
    frames = Frames(env, 50.0, most_bytes=1_000)
    env.reset(seed=0)
    for step in range(101):
        frames.look(step, last=step == 100)
    assert sum(map(len, frames.files)) <= 1_000
    steps = frames.steps.tolist()
    assert (steps[0], steps[-1]) == (0, 100)
    assert {b - a for a, b in pairwise(steps[:-1])} == {8}


def test_only_the_pictures_that_a_film_shows_are_drawn():
    env = Boundary(Drawn("rgb_array"), "Drawn-v0")
    frames = Frames(env, 200.0)
    env.reset(seed=0)
    for step in range(11):
        frames.look(step, last=step == 10)
    assert frames.steps.tolist() == [0, 4, 8, 10]


def test_pictures_of_two_sizes_are_no_film():
    env = Boundary(Drawn("rgb_array"), "Drawn-v0")
    frames = Frames(env, 50.0)
    frames.look(0)
    env.unwrapped.picture = np.zeros((5, 6, 3), np.uint8)
    with pytest.raises(NotDrawable, match=r"returned uint8\(5, 6, 3\) at step 1, must be uint8\(4"):
        frames.look(1)


@pytest.fixture(autouse=True)
def _apart(monkeypatch):
    monkeypatch.setattr(plugins, "_named", set())
    monkeypatch.setattr(plugins, "_given", {})
