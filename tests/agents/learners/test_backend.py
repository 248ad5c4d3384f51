from dataclasses import replace

import pytest

from touchdown.agents.learners import backend
from touchdown.agents.learners.backend import backend_of
from touchdown.config.config import Config
from touchdown.config.presets import preset
from touchdown.config.sections import LearningConfig, NetworkConfig
from touchdown.core import device

AUTO = Config(learning=LearningConfig(backend="auto"))


@pytest.mark.parametrize("chosen", ["jax", "fused"])
def test_a_backend_that_is_named_is_taken(chosen):
    assert backend_of(replace(AUTO, learning=LearningConfig(backend=chosen))) == chosen


def test_auto_is_the_fused_kernel_where_it_was_built_and_supports_the_settings(monkeypatch):
    assert backend_of(AUTO) == "fused"
    assert backend_of(replace(AUTO, network=NetworkConfig(activation="tanh"))) == "jax"
    assert backend_of(replace(AUTO, network=NetworkConfig(hidden_sizes=(8,) * 17))) == "jax"
    monkeypatch.setattr(backend, "is_built", lambda: False)
    assert backend_of(AUTO) == "jax"


def test_auto_is_jax_where_the_user_chose_a_gpu(monkeypatch):
    monkeypatch.setattr(device, "_chosen", ["gpu"])
    assert backend_of(AUTO) == "jax"


def test_the_preset_of_make_land_uses_the_kernel_where_it_can():
    assert preset("pilot").learning.backend == "auto"
    assert backend_of(preset("pilot")) == "fused"
