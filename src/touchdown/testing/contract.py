"""Checks that a user's agent fulfils the contract with training."""

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.agents.registry import check_fits, make_agent
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    TrainingConfig,
)
from touchdown.core import device, plugins
from touchdown.core.errors import UserError
from touchdown.core.seeding import Streams, streams
from touchdown.core.types import FloatArray, Spaces, Tensors
from touchdown.envs.boundary import Boundary
from touchdown.envs.environment import MadeEnv
from touchdown.envs.episodes import Underway
from touchdown.envs.pool import StockEnvPool
from touchdown.testing.chain import Chain
from touchdown.training.checkpoint import Progress, restore_checkpoint, save_checkpoint
from touchdown.training.loggers import Saved
from touchdown.training.loop import AgentStep, begin, interact
from touchdown.training.resume import replay_episodes

_SPACES = Spaces(Chain.STATES, 2)
_STATES: FloatArray = np.eye(Chain.STATES, dtype=np.float32)
_NUM_ENVS = 2
_LEAST_GAMMA, _MOST_GAMMA = 0.4, 0.98
_BEFORE, _AFTER = 203, 150  # steps of each environment before and after a checkpoint
_RECORD_SIZES = {"episodes.jsonl": 0, "updates.jsonl": 0, "validations.jsonl": 0}


def check_agent(
    agent: type[Agent] | str,
    *,
    options: Mapping[str, bool | int | float | str] | None = None,
    settings: Config | None = None,
    env_steps: int = 8_000,
) -> None:
    """Check that an agent of your own fulfils the contract with training.

    It must choose valid actions, learn the optimal policy of a chain of five states, repeat bit
    for bit from the same seed, and continue identically from a checkpoint on disk.

    Args:
        agent: the class, or its name, `package.module:Class`.
        options: passed to the class by name.
        settings: settings in place of the small ones for the chain; `algorithm` and `options` are
            replaced.
        env_steps: environment steps after which the policy must be optimal.

    Raises:
        AssertionError: the contract is broken; the message says how.
        UserError: the class cannot be found, lacks a member, or does not accept the options.
    """
    device.use_default()
    if isinstance(agent, str):
        plugins.allow(agent)
    name = agent if isinstance(agent, str) else plugins.give(agent)
    config = replace(settings or _small(), algorithm=name, options=dict(options or {}))
    config = replace(config, training=replace(config.training, num_envs=_NUM_ENVS))
    if not _LEAST_GAMMA <= config.learning.gamma <= _MOST_GAMMA:
        raise UserError(
            f"gamma = {config.learning.gamma}: must be from {_LEAST_GAMMA} to {_MOST_GAMMA}, where "
            "the chain's optimal policy goes right"
        )
    check_fits(config, _SPACES)
    _check_actions(config)
    _check_weights(config)
    _check_repeats(config)
    _check_resumes(config)
    _check_learns(config, env_steps)


def _small() -> Config:
    """Settings with which plain DQN learns the chain within a second or two."""
    return Config(
        network=NetworkConfig(hidden_sizes=(32,)),
        replay=ReplayConfig(capacity=4_000, min_size=32),
        exploration=ExplorationConfig(schedule="constant", epsilon_start=0.5),
        learning=LearningConfig(
            gamma=0.9, learning_rate=0.003, batch_size=32, reward_scale=0.1, target_period=100
        ),
        training=TrainingConfig(metrics_period=10),
    )


class _Setup(NamedTuple):
    """An agent at the start of training, and its environments."""

    agent: Agent
    streams: Streams
    pool: StockEnvPool

    def steps(self, underway: Underway | None = None) -> Any:
        """The training loop, from new episodes or from the given unfinished ones."""
        first = begin(self.pool, int, _NUM_ENVS) if underway is None else underway
        return interact(self.agent, self.pool, int, first)


def _set_up(config: Config) -> _Setup:
    generators = streams(config.seed)
    pool = StockEnvPool([MadeEnv(Boundary(Chain(), "Chain"), _SPACES) for _ in range(_NUM_ENVS)])
    return _Setup(make_agent(config, _SPACES, generators), generators, pool)


def _check_actions(config: Config) -> None:
    agent = _set_up(config).agent
    for _ in range(50):
        actions: Any = np.asarray(agent.act(_STATES[:_NUM_ENVS]))
        _require(
            actions.shape == (_NUM_ENVS,) and np.issubdtype(actions.dtype, np.integer),
            f"act: gave {actions!r} for {_NUM_ENVS} observations, must be as many integers",
        )
        valid = bool(((actions >= 0) & (actions < _SPACES.num_actions)).all())
        _require(valid, f"act: gave {actions!r}, must be from 0 to {_SPACES.num_actions - 1}")


def _check_weights(config: Config) -> None:
    setup = _set_up(config)
    loop = setup.steps()
    _run(loop, 100)
    weights = setup.agent.weights()
    given: Any = weights  # a user's class may not match its types
    _require(
        isinstance(given, dict) and bool(weights) and all(map(_is_array, weights.values())),
        "weights: must be a dictionary of NumPy arrays",
    )
    policy = setup.agent.policy(weights)
    kept, before = _bytes_of(weights), policy.act(_STATES).tolist()
    _run(loop, 200)
    _require(
        _bytes_of(weights) == kept and policy.act(_STATES).tolist() == before,
        "weights: changed while the agent continued to learn, must be copies",
    )
    alone = [int(policy.act(row[None])[0]) for row in _STATES]
    _require(alone == before, "policy: an action must depend on its own observation alone")
    again = setup.agent.policy({name: array.copy() for name, array in weights.items()})
    _require(
        again.act(_STATES).tolist() == before,
        "policy: the same weights must give the same policy, even after further learning",
    )


def _check_repeats(config: Config) -> None:
    one, same = (_record(_set_up(config)) for _ in range(2))
    _require(
        one == same, "two agents with the same seed differ: all randomness must come from `streams`"
    )


def _record(setup: _Setup) -> list[Any]:
    record = _run(setup.steps(), _BEFORE)
    return [*record, _bytes_of(setup.agent.weights())]


def _check_resumes(config: Config) -> None:
    setup = _set_up(config)
    underway = begin(setup.pool, int, _NUM_ENVS)
    loop = interact(setup.agent, setup.pool, int, underway)
    _run(loop, _BEFORE)
    resumed = _set_up(config)
    with tempfile.TemporaryDirectory() as folder:
        progress = Progress(records=Saved(_RECORD_SIZES))
        path = save_checkpoint(
            Path(folder), config.digest, setup.agent, setup.streams, progress, underway.episodes()
        )
        progress = restore_checkpoint(path, config.digest, resumed.agent, resumed.streams)
        episodes = replay_episodes(progress.underway, resumed.pool, int, path)
    _require(
        _bytes_of(setup.agent.weights()) == _bytes_of(resumed.agent.weights()),
        "restore: the weights differ from those of the agent that was saved",
    )
    one, other = _run(loop, _AFTER), _run(resumed.steps(episodes), _AFTER)
    for step, (wanted, got) in enumerate(zip(one, other, strict=True), start=1):
        _require(
            wanted == got,
            f"restore: {step} steps after a checkpoint the resumed agent gives {got}, the other "
            f"{wanted} (actions and metrics); something is missing in `state`",
        )
    _require(
        _bytes_of(setup.agent.weights()) == _bytes_of(resumed.agent.weights()),
        "restore: the resumed agent learns differently; something is missing in `state`",
    )


def _check_learns(config: Config, env_steps: int) -> None:
    setup = _set_up(config)
    _run(setup.steps(), env_steps // _NUM_ENVS)
    actions = setup.agent.policy(setup.agent.weights()).act(_STATES).tolist()
    _require(
        actions == [1] * Chain.STATES,
        f"the greedy policy of the chain's states is {actions} after {env_steps} environment "
        "steps, must be 1 (right) in each",
    )


def _run(loop: Any, steps: int) -> list[tuple[Any, Any]]:
    """Some steps of the training loop: the actions and the metrics of each."""
    taken: list[AgentStep] = list(islice(loop, steps))
    return [
        (step.actions.tolist(), None if step.metrics is None else _floats(step.metrics))
        for step in taken
    ]


def _floats(metrics: Mapping[str, float]) -> dict[str, float]:
    return {name: float(value) for name, value in metrics.items()}


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray)


def _bytes_of(weights: Tensors) -> dict[str, bytes]:
    return {name: array.tobytes() for name, array in weights.items()}


def _require(holds: bool, said: str) -> None:
    if not holds:
        raise AssertionError(said)
