import sys

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from touchdown.core import plugins
from touchdown.core.errors import UserError
from touchdown.envs import custom, environment
from touchdown.testing import Chain

MODULE = """
import gymnasium
from touchdown.testing import Chain

def make_chain(render_mode=None):
    made = Chain(limit=7)
    made.mode = render_mode
    return made

def no_env():
    return 5

def broken():
    raise RuntimeError("no fuel")

NUMBER = 3
if "Own/Chain-v0" not in gymnasium.registry:
    gymnasium.register("Own/Chain-v0", make_chain, reward_threshold=7.5, max_episode_steps=9)
"""


class Uncopyable(Chain):
    def __deepcopy__(self, memo):
        raise TypeError("a socket")


@pytest.fixture(autouse=True)
def _apart(monkeypatch, tmp_path):
    monkeypatch.setattr(plugins, "_named", set())
    monkeypatch.setattr(plugins, "_given", {})
    monkeypatch.setattr(custom, "_specs", {})
    monkeypatch.setattr(custom, "_objects", {})
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    (tmp_path / "own_chain.py").write_text(MODULE)
    yield
    sys.modules.pop("own_chain", None)
    gymnasium.registry.pop("Own/Chain-v0", None)


def test_an_id_of_a_module_is_registered_by_its_import():
    name = custom.name_of("own_chain:Own/Chain-v0")
    made = environment.make_env(name)
    assert made.spaces.observation_size == 5
    assert made.env.spec.max_episode_steps == 9


def test_the_threshold_that_a_module_registers_counts():
    name = custom.name_of("own_chain:Own/Chain-v0")
    assert custom.threshold_of(name) is None  # it is not imported for this
    assert "own_chain" not in sys.modules
    environment.make_env(name)
    assert custom.threshold_of(name) == 7.5


def test_a_threshold_comes_from_gymnasiums_registry():
    assert custom.threshold_of("CartPole-v1") == 475
    assert custom.threshold_of("CliffWalking-v1") is None
    assert custom.threshold_of("NoSuch-v0") is None


def test_a_function_of_a_module_makes_an_environment():
    name = custom.name_of("own_chain:make_chain")
    made = environment.make_env(name, render_mode="rgb_array")
    assert made.env.unwrapped.limit == 7
    assert made.env.unwrapped.mode == "rgb_array"  # it takes one, so it is given


def test_a_class_or_function_that_is_handed_over_makes_an_environment():
    for maker in (Chain, lambda: Chain(limit=3)):
        made = environment.make_env(custom.name_of(maker), render_mode="rgb_array")
        assert made.env.unwrapped.limit == (20 if maker is Chain else 3)


def test_an_environment_is_copied_as_it_is_now():
    env = Chain()
    env.limit = 4
    name = custom.name_of(env)
    env.limit = 3  # a decoy
    one, other = (environment.make_env(name).env for _ in range(2))
    assert one.unwrapped.limit == other.unwrapped.limit == 4
    assert one.unwrapped is not other.unwrapped
    assert name == "touchdown.testing.chain:Chain()"  # no other process finds it by this
    changed = custom.name_of(env)  # the same object, but another environment
    assert changed == "touchdown.testing.chain:Chain()2"
    assert environment.make_env(changed).env.unwrapped.limit == 3


def test_an_environment_without_a_spec_is_truncated_after_a_thousand_steps():
    made = environment.make_env(custom.name_of(lambda: Chain(limit=10_000)))
    made.env.reset(seed=0)
    ended = [made.env.step(0)[3] for _ in range(1_000)]
    assert ended == [False] * 999 + [True]


def test_a_stock_environment_is_stock_however_it_is_rendered():
    env = gymnasium.make("LunarLander-v3", render_mode="rgb_array")
    assert custom.name_of(env) == "LunarLander-v3"


def test_a_maker_with_any_keywords_is_given_the_render_mode():
    given = []

    def make(**keywords):
        given.append(keywords)
        return Chain()

    environment.make_env(custom.name_of(make), render_mode="rgb_array")
    assert given == [{"render_mode": "rgb_array"}]


def test_a_stock_environment_has_its_id_unless_it_was_changed():
    assert custom.name_of(gymnasium.make("LunarLander-v3")) == "LunarLander-v3"
    changed = gymnasium.make("LunarLander-v3")
    changed.unwrapped.gravity = -4.0
    with pytest.raises(UserError, match=r"loses what was set after it was made \(gravity = -4.0\)"):
        custom.name_of(changed)
    one, other = (gymnasium.make("LunarLander-v3", gravity=gravity) for gravity in (-4.0, -5.0))
    names = [custom.name_of(env) for env in (one, other, one)]
    stem = "gymnasium.envs.box2d.lunar_lander:LunarLander()"
    assert names == [stem, f"{stem}2", stem]
    assert [environment.make_env(name).env.unwrapped.gravity for name in names] == [-4, -5, -4]


def test_what_cannot_be_copied_is_made_again_from_its_spec():
    gymnasium.register("Own/Chain-v0", Uncopyable, kwargs={"limit": 6})
    name = custom.name_of(gymnasium.make("Own/Chain-v0", limit=4))
    assert environment.make_env(name).env.unwrapped.limit == 4


def test_an_environment_keeps_the_threshold_and_the_time_limit_of_its_spec():
    name = custom.name_of(lambda: gymnasium.make("CartPole-v1"))
    made = environment.make_env(name)
    assert custom.threshold_of(name) == 475
    made.env.reset(seed=0)
    assert made.env.spec.max_episode_steps == 500


class NoEnv:
    observation_space = spaces.Box(0, 1, (5,), np.float32)


@pytest.mark.parametrize(
    ("env", "said"),
    [
        (Uncopyable(), "cannot be copied \\(a socket\\); give a function that makes one"),
        (NoEnv(), "must be a Gymnasium id, an environment, or a function that makes one"),
        (5, "env = 5: must be a Gymnasium id"),
    ],
)
def test_what_is_no_environment_is_refused(env, said):
    with pytest.raises(UserError, match=said):
        custom.name_of(env)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("no_env", r"env_id = 'own_chain:no_env': made 5, must be a gymnasium.Env"),
        ("broken", r"env_id = 'own_chain:broken': cannot be made: RuntimeError: no fuel"),
        ("NUMBER", "NUMBER is neither a registered environment nor a function"),
        ("Nothing-v0", "module own_chain has no 'Nothing-v0'"),
    ],
)
def test_a_module_without_that_environment_is_refused_in_one_line(name, said):
    with pytest.raises(UserError, match=said) as refused:
        environment.make_env(custom.name_of(f"own_chain:{name}"))
    assert "\n" not in str(refused.value)


def test_a_module_that_only_a_file_names_is_not_imported():
    with pytest.raises(UserError, match="names code that would be imported"):
        environment.make_env("own_chain:make_chain")
    assert "own_chain" not in sys.modules
