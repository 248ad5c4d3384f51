"""Environments other than the lander, as agents see them."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from touchdown.core.errors import UserError
from touchdown.envs import environment


@pytest.fixture
def registered():
    """Registers an environment for one test."""
    names: list[str] = []

    def register(name: str, env: type[gymnasium.Env], **options) -> str:
        gymnasium.register(name, env, **options)
        names.append(name)
        return name

    yield register
    for name in names:
        gymnasium.registry.pop(name)


class Endless(gymnasium.Env):
    """Goes round in circles forever."""

    observation_space = spaces.Discrete(3)
    action_space = spaces.Discrete(2)
    first = 0

    def __init__(self, render_mode=None):
        self.render_mode = render_mode

    def reset(self, *, seed=None, options=None):
        del options
        super().reset(seed=seed)
        self.state = 0
        return self.first + self.state, {}

    def step(self, action):
        del action
        self.state = (self.state + 1) % 3
        return self.first + self.state, 0.0, False, False, {}


def test_a_discrete_environment_is_seen_one_hot_in_single_precision():
    made = environment.make_env("FrozenLake-v1")
    sizes = made.spaces
    assert (sizes.observation_size, sizes.num_actions, sizes.num_states) == (16, 4, 16)
    assert sizes.transitions is not None
    assert len(sizes.transitions) == 16
    observation, _ = made.env.reset(seed=0)
    assert observation.dtype == np.float32
    assert observation.tolist() == [1.0] + [0.0] * 15
    for _ in range(3):
        observation, *_ = made.env.step(1)
        assert observation.dtype == np.float32
        assert sorted(observation.tolist()) == [0.0] * 15 + [1.0]
    made.env.close()


def test_states_that_are_numbered_from_elsewhere_begin_at_the_first(registered):
    class Shifted(Endless):
        observation_space = spaces.Discrete(3, start=5)
        first = 5

    made = environment.make_env(registered("Shifted-v0", Shifted))
    assert made.env.reset(seed=0)[0].tolist() == [1, 0, 0]
    assert made.env.step(0)[0].tolist() == [0, 1, 0]


def test_an_environment_without_a_limit_is_cut_off_after_1000_steps(registered):
    made = environment.make_env(registered("Endless-v0", Endless))
    made.env.reset(seed=0)
    ends = [made.env.step(0)[2:4] for _ in range(1_000)]
    assert ends == [(False, False)] * 999 + [(False, True)]


def test_an_environment_with_a_limit_keeps_it(registered):
    made = environment.make_env(registered("Limited-v0", Endless, max_episode_steps=7))
    made.env.reset(seed=0)
    ends = [made.env.step(0)[3] for _ in range(7)]
    assert ends == [False] * 6 + [True]


def test_a_box_has_its_bounds_and_no_model():
    made = environment.make_env("MountainCar-v0")
    made.env.close()
    sizes = made.spaces
    assert sizes.num_states is None
    assert sizes.transitions is None
    assert sizes.low == pytest.approx((-1.2, -0.07))
    assert sizes.high == pytest.approx((0.6, 0.07))


def test_actions_that_do_not_start_at_0_are_refused(registered):
    class Odd(Endless):
        action_space = spaces.Discrete(2, start=1)

    with pytest.raises(UserError, match=r"its actions are .*, must start at 0"):
        environment.make_env(registered("Odd-v0", Odd))


def test_the_exact_landers_spaces_are_those_of_the_environment_that_is_made():
    made = environment.make_env(engine="gymnasium")
    made.env.close()
    assert environment.spaces_of("LunarLander-v3", "exact") == made.spaces
