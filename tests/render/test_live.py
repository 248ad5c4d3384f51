"""Pictures of landers by their render mode, for whoever asks as Gymnasium does."""

import io

import gymnasium
import numpy as np
import pytest
from PIL import Image

import touchdown.lander
from stepping import Always
from touchdown.envs import custom
from touchdown.envs.recorder import record_flight
from touchdown.lander import picture
from touchdown.lander.single import LanderEnv
from touchdown.lander.vector import LanderVectorEnv

PAD = np.s_[265:295, 250:350]  # rows and columns around the flags
ABOVE = np.s_[:120]


@pytest.fixture
def env():
    env = touchdown.lander.make(engine="exact", render_mode="rgb_array")
    yield env
    env.close()


def test_a_picture_is_as_large_as_stocks_and_shows_the_lander_fall(env):
    env.reset(seed=3)
    first = env.render()
    assert (first.shape, first.dtype) == ((400, 600, 3), np.uint8)
    for _ in range(30):
        env.step(0)
    later = env.render()
    assert (first[ABOVE] != later[ABOVE]).any()
    assert (first[PAD] == later[PAD]).all()  # the ground stays
    assert (later == env.render()).all()


@pytest.mark.parametrize("action", [1, 2, 3])
def test_a_flame_burns_while_its_engine_fires(env, action):
    pictures = []
    for last in (0, action):
        env.reset(seed=3)
        for each in (*[0] * 40, last):
            env.step(each)
        pictures.append(env.render().astype(int).sum(-1))
    x, y = 30 * env.unwrapped.states().positions[0, 0]
    brighter = np.argwhere(pictures[1] - pictures[0] > 60)
    assert len(brighter) > 20
    below, right = brighter.mean(axis=0) - (400 - y, x)
    if action == 2:
        assert below > 10
    else:  # action 1 pushes to the left, so its flame points to the right
        assert right > 5 if action == 1 else right < -5


def test_many_landers_have_a_picture_each(env):
    many = gymnasium.make_vec(
        "touchdown/LunarLander-v3",
        2,
        vectorization_mode="vector_entry_point",
        render_mode="rgb_array",
    )
    many.reset(seed=3)
    env.reset(seed=4)
    _, second = many.render()
    assert (second == env.render()).all()
    assert LanderVectorEnv().render() is None
    assert LanderEnv().render() is None


def test_missing_libraries_are_named_when_a_picture_is_asked_for(env, monkeypatch):
    env.reset(seed=0)
    monkeypatch.setattr(picture, "_RENDERER", "touchdown.render.missing")
    with pytest.raises(gymnasium.error.DependencyNotInstalled, match="libraries that touchdown"):
        env.render()


def test_a_flight_of_the_registered_lander_has_these_pictures():
    name = custom.name_of("touchdown.lander:touchdown/LunarLander-v3")
    flight = record_flight(Always(0), name, 3, "falling")
    assert flight.frames is not None
    assert len(flight.frames) == flight.steps + 1
    assert Image.open(io.BytesIO(flight.frames[-1])).size == (600, 400)
