"""Environments declare their mirror symmetry, and have it."""

import gymnasium
import numpy as np
import pytest

from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray, Mirror
from touchdown.envs.environment import make_env, spaces_of
from touchdown.envs.mirrors import mirror_of
from touchdown.lander import rules
from touchdown.lander.vector import LanderVectorEnv


def image_of(mirror: Mirror, observations: FloatArray) -> FloatArray:
    return observations[..., list(mirror.order)] * np.array(mirror.signs, np.float32)


@pytest.mark.parametrize("env_id", ["CartPole-v1", "Acrobot-v1"])
def test_a_mirrored_state_and_action_lead_to_the_mirrored_state(env_id):
    twins = [gymnasium.make(env_id).unwrapped for _ in range(2)]
    mirror = spaces_of(env_id).mirror
    assert mirror is not None
    rng = np.random.default_rng(0)
    for _ in range(20):
        for env in twins:
            env.reset(seed=1)
        state = rng.uniform(-0.05, 0.05, 4)
        twins[0].state, twins[1].state = state, -state
        action = int(rng.integers(env.action_space.n))
        one, *_ = twins[0].step(action)
        other, *_ = twins[1].step(mirror.actions[action])
        np.testing.assert_allclose(other, image_of(mirror, one), atol=1e-6)


def test_landers_under_mirrored_actions_fly_to_mirrored_places():
    num_envs, actions = 500, [rules.LEFT_ENGINE] * 12 + [rules.MAIN_ENGINE] * 25
    flown = []
    for seed, image in ((0, range(rules.NUM_ACTIONS)), (10_000, rules.MIRROR.actions)):
        env = LanderVectorEnv(num_envs)
        observations, _ = env.reset(seed=seed)
        for action in actions:
            observations, *_ = env.step(np.full(num_envs, image[action]))
        flown.append(observations)
        env.close()
    one, other = flown[0], image_of(rules.MIRROR, flown[1])
    error = np.sqrt((one.var(axis=0) + other.var(axis=0)) / num_envs)
    assert np.all(np.abs(one.mean(axis=0) - other.mean(axis=0)) <= 4 * error)
    assert abs(one[:, 4].mean()) > 0.1  # it turns, so that a wrong sign would be seen


class Declaring(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, mirror: object) -> None:
        self.mirror = mirror


def test_an_environment_of_the_users_declares_its_symmetry_in_an_attribute():
    declared = mirror_of(Declaring([[1, 0], [-1, -1], [0, 1]]), "mine:Env", 2, 2)
    assert declared == Mirror((1, 0), (-1.0, -1.0), (0, 1))
    assert mirror_of(Declaring(None), "mine:Env", 2, 2) is None


@pytest.mark.parametrize(
    "mirror",
    [
        "left and right",
        ([1, 0], [1, 1]),
        ([1, 1], [1, 1], [0, 1]),
        ([1, 0], [1, 2], [0, 1]),
        ([1, 0], [1, -1], [0, 1]),  # the image of an image has other signs
        ([1, 0], [1, 1], [0, 2]),
        ([1, 0], [1, 1, 1], [0, 1]),
    ],
)
def test_an_attribute_that_is_no_symmetry_is_refused(mirror):
    with pytest.raises(UserError, match=r"env_id 'mine:Env': its mirror is .*, must be the order"):
        mirror_of(Declaring(mirror), "mine:Env", 2, 2)


def test_the_stock_and_the_exact_lander_have_the_same_symmetry_and_others_may_have_none():
    assert make_env("LunarLander-v3").spaces.mirror == rules.MIRROR
    assert spaces_of("LunarLander-v3", "exact").mirror == rules.MIRROR
    assert spaces_of("MountainCar-v0").mirror is None
