import dataclasses

import numpy as np
import pytest

from touchdown.config.config import Config
from touchdown.config.sections import ReplayConfig
from touchdown.core.errors import UserError
from touchdown.core.types import Mirror, Spaces
from touchdown.replay.mirrored import Mirrored, mirror_of
from touchdown.replay.priorities import Proportional
from touchdown.replay.replay import Replay
from touchdown.replay.transition import Transition

# the first number changes sign, the other two swap; actions 0 and 2 swap
MIRROR = Mirror(order=(0, 2, 1), signs=(-1.0, 1.0, 1.0), actions=(2, 1, 0))
TRANSITION = Transition(
    o_tm1=np.array([1, 2, 3], np.float32),
    a_tm1=0,
    r_t=7.0,
    discount_t=0.5,
    terminated=False,
    a_t=1,
    o_t=np.array([4, 5, 6], np.float32),
)


def test_the_image_has_other_observations_and_actions_but_the_same_reward_and_discount():
    image = Mirrored(MIRROR)(TRANSITION)
    assert image.o_tm1.tolist() == [-1, 3, 2]
    assert image.o_t.tolist() == [-4, 6, 5]
    assert (image.a_tm1, image.a_t) == (2, 1)
    assert (image.r_t, image.discount_t, image.terminated) == (7.0, 0.5, False)


def test_the_image_of_an_image_is_the_transition():
    image = Mirrored(MIRROR)
    again = image(image(TRANSITION))
    for one, other in zip(again, TRANSITION, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_rewarded_transition_and_its_image_are_stored_equally_often():
    memory = Replay(100, 3, resaves=1, resave_threshold=6.0, mirror=MIRROR)
    memory.add(TRANSITION)
    assert memory.ring.records["a_tm1"].tolist() == [0, 0, 2, 2]


def test_images_have_priorities_of_their_own():
    memory = Replay(100, 3, priorities=Proportional(1.0, 1.0, 1), mirror=MIRROR)
    memory.add(TRANSITION)
    memory.update_priorities(np.array([0]), np.array([0.0]))
    sample = memory.sample(50, np.random.default_rng(0))
    assert set(sample.records["a_tm1"].tolist()) == {2}


def test_only_an_environment_with_a_symmetry_may_be_mirrored():
    mirrored = Config(env_id="MountainCar-v0", replay=ReplayConfig(mirrored=True))
    plain = dataclasses.replace(mirrored, replay=ReplayConfig())
    assert mirror_of(plain, Spaces(3, 3, mirror=MIRROR)) is None
    assert mirror_of(mirrored, Spaces(3, 3, mirror=MIRROR)) == MIRROR
    with pytest.raises(UserError, match="must be False for env_id = 'MountainCar-v0'"):
        mirror_of(mirrored, Spaces(3, 3))
