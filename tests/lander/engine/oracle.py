"""The engine beside stock Gymnasium, step by step, compared as bytes.

The test runs a little of this; by hand, `python tests/lander/engine/oracle.py 1000000` runs more.
"""

import argparse
import itertools
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.box2d.lunar_lander import LunarLander, heuristic

from touchdown.lander.engine import HELIPAD, Lander

MAX_EPISODE_STEPS = 1000
STEPS_AFTER_THE_END = 40  # stock flies on when it is asked to; so does the engine

Policy = Callable[[int, np.ndarray], int]  # time, observation -> action

CONFIGURATIONS: dict[str, dict[str, Any]] = {
    "default": {},
    "wind": {"enable_wind": True},
    "strong wind": {"enable_wind": True, "wind_power": 20.0, "turbulence_power": 2.0},
    "gravity -3.7": {"gravity": -3.7},
    "gravity -11.9": {"gravity": -11.9},
    "gravity -0.5": {"gravity": -0.5},
    "continuous": {"continuous": True},
    "continuous, wind": {"continuous": True, "enable_wind": True},
}


def no_op(_rng: np.random.Generator) -> Policy:
    return lambda _t, _o: 0


def main_engine(_rng: np.random.Generator) -> Policy:
    return lambda _t, _o: 2


def random(rng: np.random.Generator) -> Policy:
    return lambda _t, _o: int(rng.integers(4))


def steady(_rng: np.random.Generator) -> Policy:
    return lambda _t, o: discrete_heuristic(o)


def erring(rng: np.random.Generator) -> Policy:
    return lambda _t, o: int(rng.integers(4)) if rng.random() < 0.3 else discrete_heuristic(o)


def drop_and_tilt(rng: np.random.Generator) -> Policy:
    start, length, engine = rng.integers(60), rng.integers(5, 40), int(rng.choice([1, 3]))
    return lambda t, _o: engine if start <= t < start + length else 0


def hover(rng: np.random.Generator) -> Policy:
    height = rng.uniform(0.3, 1.0)
    return lambda _t, o: discrete_heuristic(np.concatenate([[o[0], o[1] - height], o[2:]]))


def slide(rng: np.random.Generator) -> Policy:
    """Lands, then pushes itself over the edge of the pad."""
    engine = int(rng.choice([1, 3]))
    pushing = False

    def act(t: int, o: np.ndarray) -> int:
        nonlocal pushing
        pushing = pushing or bool(o[6] and o[7])
        if not pushing:
            return discrete_heuristic(o)
        return 2 if t % 5 == 0 else engine

    return act


def pulses_near_sleep(rng: np.random.Generator) -> Policy:
    """Lands, and fires again just before or after the half second at rest is over."""
    at_rest = 0
    until = int(rng.integers(15, 40))

    def act(_t: int, o: np.ndarray) -> int:
        nonlocal at_rest, until
        if not (o[6] and o[7]):
            at_rest = 0
            return discrete_heuristic(o)
        at_rest += 1
        if at_rest < until:
            return 0
        at_rest, until = 0, int(rng.integers(15, 40))
        return int(rng.integers(1, 4))

    return act


def dive(rng: np.random.Generator) -> Policy:
    """Turns over and burns towards the ground."""
    engine, lean = int(rng.choice([1, 3])), rng.uniform(0.5, 3.0)

    def act(t: int, o: np.ndarray) -> int:
        return engine if t % 2 == 0 and abs(o[4]) < lean else 2

    return act


def bounce(rng: np.random.Generator) -> Policy:
    """Touches down on one leg, hops off, touches down again."""
    burn = 0

    def act(_t: int, o: np.ndarray) -> int:
        nonlocal burn
        if o[6] != o[7]:
            burn = int(rng.integers(5, 15))
        if burn > 0:
            burn -= 1
            return int(rng.choice([1, 2, 2, 3]))
        return discrete_heuristic(o)

    return act


POLICIES: dict[str, Callable[[np.random.Generator], Policy]] = {
    "heuristic": steady,
    "random": random,
    "no-op": no_op,
    "erring heuristic": erring,
    "main engine only": main_engine,
    "drop and tilt": drop_and_tilt,
    "hover": hover,
    "slide off the pad": slide,
    "pulses near sleep": pulses_near_sleep,
    "dive": dive,
    "bounce": bounce,
}


class _Discrete:
    """All that stock's heuristic wants to know of an environment."""

    continuous = False

    @property
    def unwrapped(self) -> "_Discrete":
        return self


def discrete_heuristic(observation: np.ndarray) -> int:
    return heuristic(_Discrete(), observation)


def continuous_action(action: int, rng: np.random.Generator) -> np.ndarray:
    """A pair that fires the same engine at some throttle, in the range or beyond it."""
    throttle = rng.uniform(0.4, 1.6)
    rest = rng.uniform(-1.4, 0.1), rng.uniform(-0.55, 0.55)
    pair = {0: rest, 1: (rest[0], -throttle), 2: (throttle - 0.4, rest[1]), 3: (rest[0], throttle)}
    return np.array(pair[action], dtype=np.float32)


@dataclass
class Report:
    """What was compared, what was met on the way, and the first difference if there is one."""

    steps: int = 0
    episodes: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    coverage: Counter[str] = field(default_factory=Counter)
    difference: str | None = None

    def add_coverage(self, coverage: dict[str, Any]) -> None:
        for name, value in coverage.items():
            if isinstance(value, tuple):
                for i, part in enumerate(value):
                    self.coverage[f"{name}[{i}]"] += part
            elif name.startswith("most_"):
                self.coverage[name] = max(self.coverage[name], value)
            else:
                self.coverage[name] += value


def difference(stock: LunarLander, engine: Lander, expected: tuple, got: tuple) -> str | None:
    """The first thing that is not the same to the last bit."""
    o, reward, terminated = expected
    if o.tobytes() != got[0].tobytes() or o.dtype != got[0].dtype:
        return f"observation {o!r} != {got[0]!r}"
    if np.float64(reward).tobytes() != np.float64(got[1]).tobytes():
        return f"reward {float(reward)!r} != {got[1]!r}"
    if terminated is not got[2]:
        return f"terminated {terminated} != {got[2]}"
    bodies = [stock.lander, *stock.legs]
    exposed = {
        "origins": ([tuple(b.position) for b in bodies], engine.origins),
        "angles": ([b.angle for b in bodies], engine.angles),
        "velocities": ([tuple(b.linearVelocity) for b in bodies], engine.velocities),
        "spins": ([b.angularVelocity for b in bodies], engine.spins),
        "awake": ([b.awake for b in bodies[:1]], [engine.awake]),
        "leg_contacts": ([leg.ground_contact for leg in stock.legs], engine.leg_contacts),
    }
    for name, (theirs, ours) in exposed.items():
        if np.asarray(theirs, np.float32).tobytes() != np.asarray(ours, np.float32).tobytes():
            return f"{name} {theirs} != {ours}"
    return None


def start_difference(
    stock: LunarLander, engine: Lander, expected: np.ndarray, got: np.ndarray
) -> str | None:
    if expected.tobytes() != got.tobytes():
        return f"observation {expected!r} != {got!r}"
    surface = np.array([poly[0] for poly in stock.sky_polys] + [stock.sky_polys[-1][1]])
    if surface.tobytes() != engine.terrain.tobytes():
        return f"terrain {surface} != {engine.terrain}"
    if (stock.helipad_x1, stock.helipad_x2, stock.helipad_y) != HELIPAD:
        return f"helipad {stock.helipad_y} != {HELIPAD}"
    return None


def outcome(stock: LunarLander, terminated: bool) -> str:
    if not terminated:
        return "timed out"
    if not stock.lander.awake:
        return "came to rest"
    return "crashed" if stock.game_over else "out of bounds"


def fly(
    report: Report,
    stock: LunarLander,
    engine: Lander,
    policy: Policy,
    rng: np.random.Generator,
    seed: int | None,
) -> Iterator[str | None]:
    """One episode and a little of what comes after it; yields each step's difference."""
    o, _ = stock.reset(seed=seed)
    yield start_difference(stock, engine, o, engine.reset(seed))
    ended_at = None
    for t in itertools.count():
        if t == (MAX_EPISODE_STEPS if ended_at is None else ended_at + STEPS_AFTER_THE_END):
            break
        discrete = policy(t, o)
        action = continuous_action(discrete, rng) if stock.continuous else discrete
        o, reward, terminated, _, _ = stock.step(action)
        report.steps += 1
        got = engine.step(action)
        found = difference(stock, engine, (o, reward, terminated), got)
        yield f"step {t}: {found}" if found else None
        if ended_at is None and terminated:
            ended_at = t
            report.outcomes[outcome(stock, terminated=True)] += 1
    if ended_at is None:
        report.outcomes["timed out"] += 1
    report.episodes += 1


def compare(
    report: Report, configuration: dict[str, Any], policy_name: str, seed: int, where: str = ""
) -> None:
    """Two episodes of one seed, the second after a reset without a seed."""
    stock = gym.make("LunarLander-v3", disable_env_checker=True, **configuration).unwrapped
    assert isinstance(stock, LunarLander)
    engine = Lander(**configuration)
    rng = np.random.default_rng(seed)
    for episode, episode_seed in enumerate((seed, None)):
        policy = POLICIES[policy_name](rng)
        for found in fly(report, stock, engine, policy, rng, episode_seed):
            if found is not None:
                report.difference = (
                    f"{where}policy {policy_name}, seed {seed}, episode {episode}, {found}"
                )
                return
    report.add_coverage(engine.coverage)


def survey(num_steps: int, first_seed: int = 0) -> dict[str, Report]:
    """All policies in all configurations, seed after seed, until that many steps are compared."""
    reports = {name: Report() for name in CONFIGURATIONS}
    for seed in itertools.count(first_seed):
        for name, configuration in CONFIGURATIONS.items():
            for policy_name in POLICIES:
                compare(reports[name], configuration, policy_name, seed, f"{name}, ")
                if reports[name].difference is not None:
                    return reports
        if sum(report.steps for report in reports.values()) >= num_steps:
            return reports
    raise AssertionError


def summary(reports: dict[str, Report]) -> str:
    lines = []
    total: Counter[str] = Counter()
    for name, report in reports.items():
        outcomes = ", ".join(f"{n} {what}" for what, n in report.outcomes.most_common())
        lines.append(
            f"{name:18} {report.steps:>10,} steps {report.episodes:>6,} episodes  {outcomes}"
        )
        for what, count in report.coverage.items():
            most = what.startswith("most_")
            total[what] = max(total[what], count) if most else total[what] + count
    lines += ["", *(f"{what:28} {count:>12,}" for what, count in total.items()), ""]
    lines.append(f"{sum(r.steps for r in reports.values()):,} steps compared")
    differences = [report.difference for report in reports.values() if report.difference]
    return "\n".join(lines + (differences or ["no difference"])) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("num_steps", type=int)
    parser.add_argument("--first-seed", type=int, default=0)
    arguments = parser.parse_args()
    reports = survey(arguments.num_steps, arguments.first_seed)
    sys.stdout.write(summary(reports))
    return int(any(report.difference for report in reports.values()))


if __name__ == "__main__":
    sys.exit(main())
