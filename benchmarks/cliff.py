"""On the cliff, Q-learning learns the short path along the edge, and SARSA a safer path.

    python benchmarks/cliff.py --out docs/pictures/cliff.png

Both explore with the same constant ε for the same number of steps. The picture shows the greedy
path of each; the table has the return while exploring, over several seeds.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from touchdown.agents.tabular import TabularAgent
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import ExplorationConfig
from touchdown.core.seeding import streams, training_start
from touchdown.envs import environment
from touchdown.envs.pool import make_pool
from touchdown.figures import policy_map, style
from touchdown.figures.grid import cells_of, grid_of
from touchdown.training.loop import begin, interact

ENV_ID = "CliffWalking-v1"
LONGEST_PATH = 100


def config_of(preset: str, seed: int) -> Config:
    """A preset on the cliff, with a constant ε of 0.1."""
    explores = ExplorationConfig(schedule="constant", epsilon_start=0.1)
    return replace(presets.preset(preset), env_id=ENV_ID, seed=seed, exploration=explores)


def learn(config: Config, steps: int) -> tuple[TabularAgent, list[float]]:
    """Train an agent for a number of steps; return it and the returns of its episodes."""
    pool = make_pool(config.env_id, 1, "gymnasium")
    agent = TabularAgent(config, pool.spaces, streams(config.seed))

    def start_of(episode: int) -> int:
        return training_start(config.seed, episode)

    agent_steps = islice(interact(agent, pool, start_of, begin(pool, start_of, 1)), steps)
    returns = [episode.episode_return for agent_step in agent_steps for episode in agent_step.ended]
    pool.close()
    return agent, returns


def greedy_path(agent: TabularAgent) -> Iterator[int]:
    """The states that the greedy policy visits from the start."""
    env = environment.make_env(ENV_ID).env
    policy = agent.policy(agent.weights())
    observation, _ = env.reset(seed=0)
    for _ in range(LONGEST_PATH):
        yield int(observation.argmax())
        observation, _, terminated, _, _ = env.step(int(policy.act(observation[None])[0]))
        if terminated:
            yield int(observation.argmax())
            return


def main() -> None:
    """Train, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3, 4])
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--out", type=Path, help="PNG of the paths of the first seed")
    args = parser.parse_args()
    grid = grid_of(environment.make_env(ENV_ID).env)
    assert grid is not None  # noqa: S101 - the cliff is a gridworld
    figure = style.new_figure(8.4, 6.4)
    axes = dict(zip(("tabular-q", "tabular-sarsa"), figure.subplots(2, 1), strict=True))
    print(f"{ENV_ID}, epsilon 0.1, {args.steps:,} steps; seeds {args.seeds}\n")
    print("| preset | steps of the greedy path, each seed | return while exploring, last 100 |")
    print("| --- | ---: | ---: |")
    for preset, ax in axes.items():
        learnt = [learn(config_of(preset, seed), args.steps) for seed in args.seeds]
        paths = [list(greedy_path(agent)) for agent, _ in learnt]
        earned = [np.mean(returns[-100:]) for _, returns in learnt]
        lengths = ", ".join(str(len(states) - 1) for states in paths)
        print(f"| `{preset}` | {lengths} | {np.mean(earned):.1f} ± {np.std(earned, ddof=1):.1f} |")
        policy_map.draw_policy(ax, grid, learnt[0][0].q)
        label = f"{preset}: {len(paths[0]) - 1} steps, {np.mean(earned):.0f} while exploring"
        policy_map.draw_path(ax, cells_of(grid, paths[0]), style.RED, label)
    if args.out:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        style.save(figure, args.out)


if __name__ == "__main__":
    main()
