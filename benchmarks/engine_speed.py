"""Steps of the lander per second: the exact engine against stock Gymnasium and EnvPool.

All step the same number of landers with the same kind of actions on one core. They take turns in
one process, so that changes in machine speed affect all. Only `step` is timed, in the
steady state, when some landers fly, some touch the ground and some are reset. Run it with
`make bench`.

Actions are random, from the PID controller, or from the policy in `--policy`.
"""

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import SyncVectorEnv

import touchdown.lander
from touchdown.core import device
from touchdown.lander._engine import simd
from touchdown.lander.vector import LanderVectorEnv
from touchdown.policies import lookup
from touchdown.runs.provenance import cpu_name

Policy = Callable[[np.ndarray], np.ndarray]


class Side:
    """A vector environment whose steps are timed.

    Args:
        env: a vector environment with Gymnasium's interface.
        policy: observations [N, 8] to actions [N].
        steps: vector steps of one round.
    """

    def __init__(self, env: Any, policy: Policy, steps: int) -> None:
        self._env = env
        self._policy = policy
        self._steps = steps
        self._observations = env.reset()[0]
        self.grounded: list[float] = []

    def fly(self, steps: int) -> float:
        """Seconds for a number of steps."""
        seconds = 0.0
        for _ in range(steps):
            actions = self._policy(self._observations)
            began = time.perf_counter()
            self._observations = self._env.step(actions)[0]
            seconds += time.perf_counter() - began
        self.grounded.append(float(np.mean(self._observations[:, 6:].any(axis=1))))
        return seconds

    def rate(self) -> float:
        """Steps of single landers per second, in one round."""
        return self._steps * len(self._observations) / self.fly(self._steps)


def random_policy(seed: int) -> Policy:
    """Uniformly random actions."""
    rng = np.random.default_rng(seed)
    return lambda observations: rng.integers(0, 4, len(observations))


def named_policy(name: str) -> Policy:
    """The actions of a policy, by its name."""
    policy = lookup.load(name).policy
    return lambda observations: np.asarray(policy.act(observations), np.int64)


def stock(num_envs: int) -> SyncVectorEnv:
    """Stock landers, stepped one after the other."""
    return SyncVectorEnv([lambda: gymnasium.make("LunarLander-v3")] * num_envs)


def envpool_landers(num_envs: int) -> Any:
    """EnvPool's landers on one thread, or None if it is not installed."""
    try:
        import envpool  # noqa: PLC0415 - optional
    except ImportError:
        return None
    return envpool.make(
        "LunarLander-v3", env_type="gymnasium", num_envs=num_envs, num_threads=1, seed=0
    )


def single_rate(env: gymnasium.Env, rng: np.random.Generator, steps: int) -> float:
    """Steps per second of one environment through Gymnasium's wrappers, without resets."""
    env.reset()
    seconds = 0.0
    for action in rng.integers(0, 4, steps).tolist():
        began = time.perf_counter()
        _, _, terminated, truncated, _ = env.step(action)
        seconds += time.perf_counter() - began
        if terminated or truncated:
            env.reset()
    return steps / seconds


def compare(title: str, sides: dict[str, Callable[[], float]], rounds: int) -> None:
    """Take turns; print the rate of each side, and the ratios of the first to the others."""
    rates: dict[str, list[float]] = {name: [] for name in sides}
    for _ in range(rounds):
        for name, rate in sides.items():
            rates[name].append(rate())
    print(f"\n{title:34}{'median steps/s':>16}{'lowest':>10}{'highest':>10}")
    for name, values in rates.items():
        print(
            f"  {name:32}{statistics.median(values):16,.0f}{min(values):10,.0f}{max(values):10,.0f}"
        )
    first, *others = rates
    for name in others:
        ratios = [a / b for a, b in zip(rates[first], rates[name], strict=True)]
        print(
            f"  {'ratio to ' + name:32}{statistics.median(ratios):16.2f}"
            f"{min(ratios):10.2f}{max(ratios):10.2f}"
        )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--num-envs", type=int, default=1024)
    names = ("--policy", "--pilot")  # the second is the former name
    parser.add_argument(*names, default="pid", help="name or file of a policy")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    device.use("cpu")
    print(
        f"{cpu_name()}, one core, {simd()}; Python {platform.python_version()}, gymnasium "
        f"{gymnasium.__version__}; {args.num_envs} environments, seed {args.seed}, "
        f"{args.rounds} rounds"
    )
    policies = {
        "random actions": lambda: random_policy(args.seed),
        f"{args.policy}'s actions": lambda: named_policy(args.policy),
    }
    for title, policy in policies.items():
        envs = {
            "touchdown": (touchdown.lander.make_vec(args.num_envs, engine="exact"), 100),
            "stock SyncVectorEnv": (stock(args.num_envs), 10),
            "EnvPool": (envpool_landers(args.num_envs), 50),
        }
        sides = {
            name: Side(env, policy(), steps)
            for name, (env, steps) in envs.items()
            if env is not None
        }
        for side in sides.values():
            side.fly(600)  # until the episodes end at different times
        compare(title, {name: side.rate for name, side in sides.items()}, args.rounds)
        print(f"  on the ground: {np.mean(sides['touchdown'].grounded):.0%} of touchdown's landers")
        for env, _ in envs.values():
            if env is not None:
                env.close()

    rng = np.random.default_rng(args.seed)
    ones = {
        "touchdown": touchdown.lander.make(engine="exact"),
        "stock": touchdown.lander.make(engine="gymnasium"),
    }
    for env in ones.values():
        env.reset(seed=args.seed)
    compare(
        "one environment, random actions",
        {name: lambda env=env: single_rate(env, rng, 3_000) for name, env in ones.items()},
        args.rounds,
    )

    os.sched_setaffinity(0, cores)
    threads = {
        f"{count} thread{'s' * (count > 1)}": Side(
            LanderVectorEnv(args.num_envs, num_threads=count), random_policy(args.seed), 100
        )
        for count in (2, 1)
    }
    for side in threads.values():
        side.fly(300)
    compare(
        f"threads, random actions, {len(cores)} cores",
        {name: side.rate for name, side in threads.items()},
        args.rounds,
    )


if __name__ == "__main__":
    main()
