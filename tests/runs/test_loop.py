"""Which loop trains a run."""

import json
from dataclasses import replace
from typing import Any

import pytest

from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import LearningConfig
from touchdown.runs import folder as folders
from touchdown.runs import loop as loops
from touchdown.runs.loop import why_python

FUSED = Config(learning=LearningConfig(backend="fused"))


def with_(section: str, **values: Any) -> Config:
    return replace(FUSED, **{section: replace(getattr(FUSED, section), **values)})


def test_dqn_and_pqn_with_fused_updates_on_the_exact_engine_are_compiled():
    assert why_python(presets.preset("swift")) is None
    assert why_python(with_("network", noisy=True)) is None
    assert why_python(FUSED) is None
    assert why_python(with_("learning", backend="auto")) is None
    settings = {"double": True, "polyak": 0.1, "loss": "huber", "n_step": 3}
    assert why_python(with_("learning", **settings)) is None
    assert why_python(with_("learning", averaging=0.01)) is None
    assert why_python(with_("learning", target="sarsa")) is None
    assert why_python(with_("replay", resaves=3, mirrored=True)) is None
    assert why_python(with_("training", num_envs=3)) is None


@pytest.mark.parametrize(
    ("config", "reason"),
    [
        (Config(algorithm="tabular"), "algorithm = 'tabular'"),
        (Config(algorithm="pqn"), "backend = 'jax'"),
        (Config(), "backend = 'jax'"),
        (with_("learning", backend="auto", optimizer="sgd"), "backend = 'jax'"),
        (replace(FUSED, env_id="CartPole-v1"), "env_id = 'CartPole-v1'"),
    ],
)
def test_what_the_compiled_loop_does_not_support_is_the_reason(config, reason):
    assert why_python(config) == reason


def test_stock_gymnasium_and_an_installation_without_a_compiler_are_reasons(monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("touchdown.lander.engine._chosen", ["gymnasium"])
        assert why_python(FUSED) == "engine = 'gymnasium'"
    monkeypatch.setattr(loops, "is_built", lambda: False)
    assert why_python(FUSED) == "the compiled loop was not built"


def test_provenance_names_the_loop_and_the_reason(tmp_path):
    facts = []
    for config in (FUSED, Config()):
        folder = folders.create(tmp_path, config, config.learning.backend)
        read = json.loads(folder.provenance.read_text())
        facts.append((read["loop"], read["why_python"]))
    assert facts == [("compiled", None), ("python", "backend = 'jax'")]
