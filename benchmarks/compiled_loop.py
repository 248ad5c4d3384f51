"""Environment steps per second of the compiled training loop, compared with Python's loop.

Both train the same agent with the fused backend on the exact engine: DQN with minibatches of 64 and
a target network, from a memory with 1,000 transitions on, and PQN with the settings of the preset
`swift`. They take turns in one process on one core, so that changes in machine speed affect both;
DQN's updates alone, from the same memory, take a turn too.
"""

import argparse
import os
import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners.factory import make_learner
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.registry import make_agent
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    TrainingConfig,
)
from touchdown.core import device
from touchdown.core.seeding import streams, training_start
from touchdown.envs.environment import spaces_of
from touchdown.envs.pool import ExactEnvPool, make_pool
from touchdown.lander._engine import simd
from touchdown.runs.provenance import cpu_name
from touchdown.training.compiled import CompiledLoop
from touchdown.training.compiled_pqn import CompiledPQN
from touchdown.training.loop import AgentStep, begin, interact


class Case(NamedTuple):
    """A row of the table."""

    num_envs: int
    update_period: int = 0
    hidden_sizes: tuple[int, ...] = (100, 100, 100)
    agent: Literal["DQN", "noisy DQN", "deep SARSA", "PQN"] = "DQN"


CASES = [
    Case(1, 1),
    Case(1, 4),
    Case(16, 4),
    Case(1, 4, (64, 64)),
    Case(1, 4, (64, 64), "noisy DQN"),
    Case(1, 4, (64, 64), "deep SARSA"),
    Case(16, hidden_sizes=(64, 64), agent="PQN"),
    Case(64, hidden_sizes=(64, 64), agent="PQN"),
]


def config_of(case: Case) -> Config:
    """The settings of both loops."""
    if case.agent == "PQN":
        swift = presets.preset("swift")
        return replace(swift, training=replace(swift.training, num_envs=case.num_envs))
    return Config(
        network=NetworkConfig(hidden_sizes=case.hidden_sizes, noisy=case.agent == "noisy DQN"),
        replay=ReplayConfig(capacity=100_000, min_size=1_000),
        exploration=ExplorationConfig(schedule="constant", epsilon_start=0.1),
        learning=LearningConfig(
            backend="fused",
            target="sarsa" if case.agent == "deep SARSA" else "q-learning",
            target_period=800,
            update_period=case.update_period,
        ),
        training=TrainingConfig(num_envs=case.num_envs),
    )


class Side:
    """One of the loops; trains for a given number of further environment steps."""

    def __init__(self, config: Config, *, compiled: bool) -> None:
        generators = streams(config.seed)
        pool = make_pool(config.env_id, config.training.num_envs, "exact")
        agent = make_agent(config, pool.spaces, generators)
        assert isinstance(agent, DQNAgent | PQNAgent)  # noqa: S101 - as the config says
        assert isinstance(pool, ExactEnvPool)  # noqa: S101

        def start_of(episode: int) -> int:
            return training_start(config.seed, episode)

        underway = begin(pool, start_of, config.training.num_envs)
        self.agent = agent
        self._steps: Iterator[AgentStep]
        if not compiled:
            self._steps = interact(agent, pool, start_of, underway)
        elif isinstance(agent, PQNAgent):
            pqn = CompiledPQN(agent, pool, generators, config)
            self._steps = pqn.interact(start_of, underway)
        else:
            dqn = CompiledLoop(agent, pool, generators, config)
            self._steps = dqn.interact(start_of, underway)

    def train(self, env_steps: int) -> float:
        """Seconds per environment step."""
        first, began = self.agent.env_steps, time.perf_counter()
        while self.agent.env_steps < first + env_steps:
            next(self._steps)
        return (time.perf_counter() - began) / (self.agent.env_steps - first)


class Updates:
    """The updates of a number of environment steps, in one call of the kernel."""

    def __init__(self, config: Config, filled: DQNAgent) -> None:
        self._config, self._replay = config.learning, filled.replay
        self._learner = make_learner(config, spaces_of(config.env_id, "exact"))
        self._observations = np.zeros((1, 8), np.float32)

    def train(self, env_steps: int) -> float:
        """Seconds per environment step."""
        config, rng = self._config, np.random.default_rng(0)
        count = env_steps // config.update_period
        records = self._replay.sample(count * config.batch_size, rng).records
        packed = records.view(np.float32).reshape(count, config.batch_size, -1)
        began = time.perf_counter()
        self._learner.update(packed, None, self._observations, 0, measured=False)
        return (time.perf_counter() - began) / env_steps


def updates_alone(config: Config, filled: Side) -> list[Updates]:
    """DQN's updates; PQN has no memory to draw them from."""
    return [Updates(config, filled.agent)] if isinstance(filled.agent, DQNAgent) else []


def main() -> None:
    """Take turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--steps", type=int, default=3_000, help="environment steps per round")
    args = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    device.use("cpu")
    print(f"{cpu_name()}, one core, {simd()}; medians of {args.rounds} rounds\n")
    print("| agent | environments | update period | Python, steps/s | compiled, steps/s | ", end="")
    print("speed-up, median (min-max) | updates alone, steps/s |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for case in CASES:
        config = config_of(case)
        python, compiled = (Side(config, compiled=compiled) for compiled in (False, True))
        for side in (python, compiled):
            side.train(2 * config.replay.min_size)  # past the warm-up of the replay memory
        sides = python, compiled, *updates_alone(config, python)
        rollout = case.num_envs * config.rollout.rollout_steps
        steps = max(args.steps, rollout) if case.agent == "PQN" else args.steps
        rounds = [[side.train(steps) for side in sides] for _ in range(args.rounds)]
        slow, fast, *updates = (
            f"{1 / statistics.median(seconds):,.0f}" for seconds in zip(*rounds, strict=True)
        )
        ratios = [a / b for a, b, *_ in rounds]
        ratio = f"{statistics.median(ratios):.2f} ({min(ratios):.2f}-{max(ratios):.2f})"
        print(
            f"| {case.agent}, {list(case.hidden_sizes)} | {case.num_envs} "
            f"| {case.update_period or '–'} | {slow} | {fast} "
            f"| {ratio} | {updates[0] if updates else '–'} |"
        )


if __name__ == "__main__":
    main()
