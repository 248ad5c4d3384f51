"""The cost of each part of DQN: the time of one update compared with plain DQN's, on one core.

Every agent gets the same random transitions, one update each, from a full replay memory, with the
network and the minibatch of the preset `pilot`. Agents take turns in one process, so that changes
in machine speed affect all.
"""

import argparse
import os
import statistics
import time
from dataclasses import replace
from itertools import cycle, islice, pairwise

import numpy as np

from touchdown import Config
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners.factory import make_learner
from touchdown.config import presets
from touchdown.core import device
from touchdown.core.seeding import streams
from touchdown.core.types import FloatArray, IntArray, Spaces, StepResult
from touchdown.runs.provenance import cpu_name

SPACES = Spaces(observation_size=8, num_actions=4)
PLAIN = presets.preset("pilot")
PARTS: dict[str, dict[str, dict[str, object]]] = {
    "plain DQN": {},
    "SARSA": {"learning": {"target": "sarsa"}},
    "double": {"learning": {"double": True}},
    "3-step": {"learning": {"n_step": 3}},
    "polyak": {"learning": {"target_period": 0, "polyak": 0.005}},
    "dueling": {"network": {"dueling": True}},
    "layer norm": {"network": {"layer_norm": True}},
    "32 quantiles": {"network": {"quantiles": 32}},
    "51 atoms": {"network": {"atoms": 51, "v_min": -30.0, "v_max": 30.0}},
    "noisy": {"network": {"noisy": True}},
    "prioritized": {"replay": {"prioritized": True}},
}


def config_of(part: str) -> Config:
    """The config of `pilot` with one part added, and without metrics."""
    config = replace(PLAIN, training=replace(PLAIN.training, metrics_period=10**9))
    for section, values in PARTS[part].items():
        config = replace(config, **{section: replace(getattr(config, section), **values)})
    return config


def new_agent(config: Config) -> DQNAgent:
    """A fresh agent."""
    return DQNAgent(config, SPACES, streams(config.seed), make_learner(config, SPACES))


class Fed:
    """An agent with a full replay memory, and the transitions that it observes."""

    def __init__(self, config: Config, rng: np.random.Generator) -> None:
        self._agent = new_agent(config)
        rows = rng.normal(size=(2_001, 1, 8)).astype(np.float32)
        no = np.zeros(1, np.bool_)
        # made in advance, so that only the agent's time is measured
        self._fed: list[tuple[FloatArray, IntArray, StepResult]] = [
            (row, np.array([i % 4]), StepResult(after, row[:, 0].astype(float), no, no))
            for i, (row, after) in enumerate(pairwise(rows))
        ]
        waiting = replace(config, replay=replace(config.replay, min_size=config.replay.capacity))
        filler = new_agent(waiting)
        self._feed(filler, config.replay.capacity - 1)
        self._agent.replay.restore(filler.replay.tensors(), filler.replay.ring.added)

    def _feed(self, agent: DQNAgent, count: int) -> None:
        for o_tm1, a_tm1, steps in islice(cycle(self._fed), count):
            agent.observe(o_tm1, a_tm1, steps, steps.observations)

    def seconds(self, updates: int) -> float:
        """Mean seconds of one environment step with its update."""
        began = time.perf_counter()
        self._feed(self._agent, updates)
        np.asarray(self._agent.learner.state.online_params)
        return (time.perf_counter() - began) / updates


def main() -> None:
    """Take turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--updates", type=int, default=1_000, help="updates per round")
    args = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    device.start()
    agents = {part: Fed(config_of(part), np.random.default_rng(0)) for part in PARTS}
    for agent in agents.values():
        agent.seconds(200)  # after the compilation
    times: dict[str, list[float]] = {part: [] for part in agents}
    for _ in range(args.rounds):
        for part, agent in agents.items():
            times[part].append(agent.seconds(args.updates))
    print(f"{cpu_name()}, one core; {args.rounds} rounds of {args.updates} updates\n")
    print("| part | µs per update, median | ratio to plain DQN, median (min-max) |")
    print("| --- | ---: | ---: |")
    for part, values in times.items():
        ratios = [a / b for a, b in zip(values, times["plain DQN"], strict=True)]
        print(
            f"| {part} | {statistics.median(values) * 1e6:.0f} | {statistics.median(ratios):.2f} "
            f"({min(ratios):.2f}-{max(ratios):.2f}) |"
        )


if __name__ == "__main__":
    main()
