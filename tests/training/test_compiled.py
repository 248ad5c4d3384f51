"""The compiled loop and its slow twin, Python's loop, give the same bytes."""

import json
import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.random import default_rng

from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners.fused import FusedLearner, adam_of
from touchdown.agents.registry import make_agent
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    TrainingConfig,
)
from touchdown.core import files
from touchdown.core.errors import Interrupted
from touchdown.core.seeding import Streams, streams, training_start
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.pool import ExactEnvPool, make_pool
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.training import _train
from touchdown.training.compiled import CompiledLoop
from touchdown.training.loop import STEPS_BETWEEN_LOOKS, AgentStep, begin, interact
from touchdown.training.trainer import Trainer


def config_of(**sections: dict[str, Any]) -> Config:
    """Small settings under which episodes end, the memory wraps around and updates take place."""
    learning = {"batch_size": 8, "backend": "fused"} | sections.pop("learning", {})
    replay = {"capacity": 500, "min_size": 40} | sections.pop("replay", {})
    training = {"metrics_period": 70} | sections.pop("training", {})
    exploration = {"epsilon_decay": 0.8} | sections.pop("exploration", {})
    network = {"hidden_sizes": (12, 8)} | sections.pop("network", {})
    assert not sections
    return Config(
        seed=3,
        network=NetworkConfig(**network),
        replay=ReplayConfig(**replay),
        exploration=ExplorationConfig(**exploration),
        learning=LearningConfig(**learning),
        training=TrainingConfig(**training),
    )


SETTINGS: dict[str, dict[str, dict[str, Any]]] = {
    "plain": {},
    "three environments": {"training": {"num_envs": 3}},
    "forty environments": {"training": {"num_envs": 40}, "learning": {"update_period": 16}},
    "re-saves": {"replay": {"resaves": 2, "resave_threshold": 0.5}},
    "copies of the target": {"learning": {"target_period": 30, "double": True}},
    "soft updates": {"learning": {"polyak": 0.01, "max_grad_norm": 1.0, "reward_scale": 0.1}},
    "many updates": {"learning": {"update_period": 4, "gradient_steps": 3, "loss": "huber"}},
    "many updates of three": {
        "learning": {"update_period": 4, "gradient_steps": 3, "target_period": 7},
        "training": {"num_envs": 3, "metrics_period": 5},
    },
    "constant ε": {"exploration": {"schedule": "constant", "epsilon_start": 0.3}},
    "only random actions": {"exploration": {"schedule": "constant", "epsilon_start": 1.0}},
    "only greedy actions": {"exploration": {"schedule": "constant", "epsilon_start": 0.0}},
    "linear ε": {"exploration": {"schedule": "linear", "epsilon_duration": 400}},
    "falling learning rate": {"learning": {"learning_rate_duration": 300}},
    "rising learning rate": {
        "learning": {"learning_rate_duration": 300, "learning_rate_end": 0.01}
    },
    "dueling, layer norm": {"network": {"dueling": True, "layer_norm": True}},
}


class Twin(NamedTuple):
    """A loop and everything that it changes."""

    agent: DQNAgent
    pool: ExactEnvPool
    streams: Streams
    underway: Underway
    steps: Iterator[AgentStep]


def twin(config: Config, *, compiled: bool) -> Twin:
    generators = streams(config.seed)
    pool = make_pool(config.env_id, config.training.num_envs, "exact")
    agent = make_agent(config, pool.spaces, generators)
    assert isinstance(agent, DQNAgent)
    assert isinstance(pool, ExactEnvPool)

    def start_of(episode: int) -> int:
        return training_start(config.seed, episode)

    underway = begin(pool, start_of, config.training.num_envs)
    if compiled:
        steps = CompiledLoop(agent, pool, generators, config).interact(start_of, underway)
    else:
        steps = interact(agent, pool, start_of, underway)
    return Twin(agent, pool, generators, underway, steps)


def told(step: AgentStep) -> dict[str, Any]:
    """What a step tells, as bytes where it has arrays."""
    return {
        "actions": step.actions.tobytes(),
        "result": [part.tobytes() for part in step.result],
        "epsilon": step.epsilon,
        "ended": [(e.number, e.actions, e.episode_return) for e in step.ended],
        "metrics": step.metrics,
    }


def bytes_of(each: Twin) -> dict[str, Any]:
    """Everything that a checkpoint has of a twin, and its environments."""
    parts: dict[str, Any] = {}
    for name, value in each.agent.state().items():
        if isinstance(value, dict):
            parts |= {f"{name}/{key}": array.tobytes() for key, array in value.items()}
        else:
            parts[name] = value
    parts["generators"] = [rng.bit_generator.state for rng in each.streams]
    parts["underway"] = [
        (e.number, e.observation.tobytes(), e.actions, e.episode_return)
        for e in each.underway.episodes()
    ]
    envs = range(len(each.pool.actions))
    parts["pool"] = [
        *(each.pool.batch.snapshot(index) for index in envs),
        each.pool.steps.tobytes(),
    ]
    return parts


@pytest.mark.parametrize("name", SETTINGS)
def test_both_loops_give_the_same_bytes_at_every_step_that_the_compiled_one_yields(name):
    config = config_of(**SETTINGS[name])
    fast, slow = (twin(config, compiled=compiled) for compiled in (True, False))
    count, ended, measured = 0, 0, 0
    while count < 1_000 // config.training.num_envs + 300:
        step = next(fast.steps)
        skipped = [next(slow.steps) for _ in range(step.count)]
        assert all(not each.ended and each.metrics is None for each in skipped[:-1])
        assert told(step) == told(skipped[-1])
        assert bytes_of(fast) == bytes_of(slow)
        count += step.count
        ended += len(step.ended)
        measured += step.metrics is not None
    assert ended >= 5
    assert measured >= 1
    assert fast.agent.updates > 20
