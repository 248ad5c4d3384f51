"""Configs of runs that take a second."""

from dataclasses import replace

from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import TrainingConfig


def tiny(env_id: str = "LunarLander-v3", **training) -> Config:
    """`pilot` with a small network, for three episodes; `training` changes that section."""
    settings = {
        "episodes": 3,
        "validation_period": 50,
        "validation_episodes": 2,
        "final_validation_episodes": 2,
        "test_episodes": 2,
    }
    base = presets.preset("pilot")
    return replace(
        base,
        env_id=env_id,
        network=replace(base.network, hidden_sizes=(8,)),
        replay=replace(base.replay, min_size=50),
        training=TrainingConfig(**(settings | training)),
    )


def lake(**changes) -> Config:
    """`tabular-q` on a frozen lake for 300 env steps; `changes` are of the config's top level."""
    base = presets.preset("tabular-q")
    settings = {
        "max_env_steps": 300,
        "validation_period": 100,
        "validation_episodes": 2,
        "final_validation_episodes": 2,
        "test_episodes": 2,
    }
    return replace(base, training=replace(base.training, **settings), **changes)
