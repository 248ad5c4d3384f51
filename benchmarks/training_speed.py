"""Training steps per second with one update per step, compared with Stable-Baselines3's DQN.

Both sides have the same environment, network [100, 100, 100], batch 64, replay memory, target
period, ε and optimiser, one thread and one core. They take turns in one process, so that changes
in machine speed affect both. Run it with `make bench`.
"""

import argparse
import os
import platform
import statistics
import time
from collections import deque
from collections.abc import Callable
from itertools import islice

import gymnasium
import stable_baselines3
import torch
from stable_baselines3 import DQN

from touchdown.agents.dqn import DQNAgent
from touchdown.agents.registry import make_agent
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import ExplorationConfig, LearningConfig, ReplayConfig
from touchdown.core import device
from touchdown.core.seeding import streams, training_start
from touchdown.envs import environment
from touchdown.envs.pool import ExactEnvPool, make_pool
from touchdown.lander import engine as engines
from touchdown.runs.provenance import cpu_name
from touchdown.training.compiled import CompiledLoop
from touchdown.training.loop import begin, interact

EPSILON = 0.1


def same_numbers(seed: int) -> Config:
    """The settings that both sides use."""
    return Config(
        seed=seed,
        network=presets.preset("target-dqn").network,
        replay=ReplayConfig(capacity=100_000, min_size=1_000),
        exploration=ExplorationConfig(schedule="constant", epsilon_start=EPSILON),
        learning=LearningConfig(
            backend="auto", batch_size=64, learning_rate=5e-4, target_period=800
        ),
    )


def ours(
    config: Config, engine: engines.Engine, *, compiled: bool = False
) -> Callable[[int], object]:
    """A function that trains for a given number of further steps."""
    spaces = environment.spaces_of(config.env_id, engine=engine)
    generators = streams(config.seed)
    agent = make_agent(config, spaces, generators)
    pool = make_pool(config.env_id, config.training.num_envs, engine)

    def start_of(episode: int) -> int:
        return training_start(config.seed, episode)

    episodes = begin(pool, start_of, config.training.num_envs)
    if not compiled:
        steps = interact(agent, pool, start_of, episodes)
        return lambda count: deque(islice(steps, count), maxlen=0)
    assert isinstance(agent, DQNAgent)  # noqa: S101 - as the config says
    assert isinstance(pool, ExactEnvPool)  # noqa: S101
    many_steps = CompiledLoop(agent, pool, generators, config).interact(start_of, episodes)

    def train(count: int) -> None:
        last = agent.env_steps + count
        while agent.env_steps < last:
            next(many_steps)

    return train


def theirs(config: Config) -> Callable[[int], object]:
    """The same for Stable-Baselines3."""
    learning = config.learning
    model = DQN(
        "MlpPolicy",
        gymnasium.make(config.env_id),
        learning_rate=learning.learning_rate,
        buffer_size=config.replay.capacity,
        learning_starts=config.replay.min_size,
        batch_size=learning.batch_size,
        gamma=learning.gamma,
        train_freq=1,
        gradient_steps=1,
        target_update_interval=learning.target_period,
        exploration_initial_eps=EPSILON,
        exploration_final_eps=EPSILON,
        policy_kwargs={"net_arch": list(config.network.hidden_sizes)},
        seed=config.seed,
        device="cpu",
    )
    return lambda count: model.learn(count, reset_num_timesteps=False)


def main() -> None:
    """Take turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--steps", type=int, default=3_000, help="environment steps per round")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    torch.set_num_threads(1)
    device.use("cpu")
    config = same_numbers(args.seed)
    sides = {
        "touchdown": ours(config, "exact", compiled=True),
        "touchdown, Python's loop": ours(config, "exact"),
        "touchdown on stock": ours(config, "gymnasium"),
        "stable-baselines3": theirs(config),
    }
    for train in sides.values():
        train(2 * config.replay.min_size)  # past compilation and warm-up of the replay memory
    rates: dict[str, list[float]] = {name: [] for name in sides}
    for _ in range(args.rounds):
        for name, train in sides.items():
            began = time.perf_counter()
            train(args.steps)
            rates[name].append(args.steps / (time.perf_counter() - began))
    print(
        f"{cpu_name()}, one core; Python {platform.python_version()}, torch {torch.__version__}, "
        f"stable-baselines3 {stable_baselines3.__version__}; seed {args.seed}, "
        f"{args.rounds} rounds of {args.steps} steps"
    )
    print(f"{'':26}{'median steps/s':>16}{'lowest':>10}{'highest':>10}")
    for name, values in rates.items():
        print(
            f"{name:26}{statistics.median(values):16,.0f}{min(values):10,.0f}{max(values):10,.0f}"
        )
    *own, peer = rates
    for name in own:
        ratios = [a / b for a, b in zip(rates[name], rates[peer], strict=True)]
        print(
            f"{name + ', ratio':34}{statistics.median(ratios):8.1f}"
            f"{min(ratios):10.1f}{max(ratios):10.1f}"
        )


if __name__ == "__main__":
    main()
