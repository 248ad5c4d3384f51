"""Compare the engine with stock Gymnasium, step by step and byte by byte.

The tests run some of this; `make exactness N=1000000` runs more.
"""

import argparse
import itertools
import multiprocessing
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.box2d.lunar_lander import LunarLander, heuristic
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from touchdown.lander._engine import HELIPAD, Batch, simd
from touchdown.lander.rules import BEGIN, MAX_EPISODE_STEPS, NOTHING, STEP
from touchdown.lander.space import LanderStates, read_states, read_terrain

STEPS_AFTER_THE_END = 40  # stock can be stepped after the end, and so can the engine
NUM_EPISODES = 2  # of each environment; the second after a reset without a seed

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

    def add(self, other: "Report") -> None:
        self.steps += other.steps
        self.episodes += other.episodes
        self.outcomes.update(other.outcomes)
        self.add_coverage(other.coverage)
        self.difference = self.difference or other.difference


def difference(
    stock: LunarLander, expected: tuple, got: tuple, states: LanderStates, index: int
) -> str | None:
    """The first value that differs in any bit; None if all are equal."""
    o, reward, terminated = expected
    if o.tobytes() != got[0].tobytes() or o.dtype != got[0].dtype:
        return f"observation {o!r} != {got[0]!r}"
    if np.float64(reward).tobytes() != np.float64(got[1]).tobytes():
        return f"reward {float(reward)!r} != {got[1]!r}"
    if terminated is not bool(got[2]):
        return f"terminated {terminated} != {got[2]}"
    bodies = [stock.lander, *stock.legs]
    exposed = {
        "positions": ([tuple(b.position) for b in bodies], states.positions),
        "angles": ([b.angle for b in bodies], states.angles),
        "velocities": ([tuple(b.linearVelocity) for b in bodies], states.velocities),
        "angular_velocities": ([b.angularVelocity for b in bodies], states.angular_velocities),
        "awake": (stock.lander.awake, states.awake),
        "leg_contacts": ([leg.ground_contact for leg in stock.legs], states.leg_contacts),
    }
    for name, (theirs, ours) in exposed.items():
        if np.asarray(theirs, ours.dtype).tobytes() != ours[index].tobytes():
            return f"{name} {theirs} != {ours[index]}"
    return None


def start_difference(
    stock: LunarLander, expected: np.ndarray, got: np.ndarray, terrain: np.ndarray
) -> str | None:
    if expected.tobytes() != got.tobytes():
        return f"observation {expected!r} != {got!r}"
    surface = np.array([poly[0] for poly in stock.sky_polys] + [stock.sky_polys[-1][1]])
    if surface.tobytes() != terrain.tobytes():
        return f"terrain {surface} != {terrain}"
    if (stock.helipad_x1, stock.helipad_x2, stock.helipad_y) != HELIPAD:
        return f"helipad {stock.helipad_y} != {HELIPAD}"
    return None


def outcome(stock: LunarLander, terminated: bool) -> str:
    if not terminated:
        return "timed out"
    if not stock.lander.awake:
        return "came to rest"
    return "crashed" if stock.game_over else "out of bounds"


class Flown:
    """One stock environment on its way through its episodes, and what it expects of the engine."""

    def __init__(self, configuration: dict[str, Any], policy_name: str, seed: int) -> None:
        stock = gym.make("LunarLander-v3", disable_env_checker=True, **configuration).unwrapped
        assert isinstance(stock, LunarLander)
        self.stock = stock
        self.seed = seed
        self.name = f"policy {policy_name}, seed {seed}"
        self._make_policy = POLICIES[policy_name]
        self._rng = np.random.default_rng(seed)
        self.episode = -1
        self.time = 0
        self._ended_at: int | None = None
        self.task = BEGIN

    def choose(self) -> int | np.ndarray:
        """The next action, before anything is stepped."""
        if self.task != STEP:
            return np.zeros(2, np.float32) if self.stock.continuous else 0
        action = self._policy(self.time, self._o)
        return continuous_action(action, self._rng) if self.stock.continuous else action

    def advance(self, report: Report, action: int | np.ndarray) -> tuple[np.ndarray, float, bool]:
        """Fly stock by its task, and choose the next task."""
        if self.task == BEGIN:
            self.episode += 1
            self.time, self._ended_at = 0, None
            self._policy = self._make_policy(self._rng)
            self._o, _ = self.stock.reset(seed=self.seed if self.episode == 0 else None)
            self.task = STEP
            return self._o, 0.0, False
        self._o, reward, terminated, _, _ = self.stock.step(action)
        report.steps += 1
        if self._ended_at is None and terminated:
            self._ended_at = self.time
            report.outcomes[outcome(self.stock, terminated=True)] += 1
        self.time += 1
        last = MAX_EPISODE_STEPS if self._ended_at is None else self._ended_at + STEPS_AFTER_THE_END
        if self.time >= last:
            if self._ended_at is None:
                report.outcomes["timed out"] += 1
            report.episodes += 1
            self.task = BEGIN if self.episode + 1 < NUM_EPISODES else NOTHING
        return self._o, float(reward), terminated


def compare(
    configuration: dict[str, Any], seeds: Iterable[int], num_threads: int = 1, where: str = ""
) -> Report:
    """Every policy with every seed, all in one batch of the engine."""
    report = Report()
    flown = [Flown(configuration, policy_name, seed) for seed in seeds for policy_name in POLICIES]
    count = len(flown)
    batch = Batch(count, num_threads=num_threads, **configuration)
    for i, each in enumerate(flown):
        batch.seed(i, each.seed)
    continuous = configuration.get("continuous", False)
    actions = np.zeros((count, 2), np.float32) if continuous else np.zeros(count, np.int64)
    observations, rewards = np.zeros((count, 8), np.float32), np.zeros(count)
    terminated = np.zeros(count, np.bool_)
    while any(each.task != NOTHING for each in flown):
        tasks = np.array([each.task for each in flown], np.uint8)
        for i, each in enumerate(flown):
            actions[i] = each.choose()
        batch.step(actions, observations, rewards, terminated, tasks)
        states = read_states(batch)
        for i, each in enumerate(flown):
            if tasks[i] == NOTHING:
                continue
            time_before = each.time
            expected = each.advance(report, actions[i] if continuous else int(actions[i]))
            got = observations[i], rewards[i], terminated[i]
            found = difference(each.stock, expected, got, states, i)
            if found is None and tasks[i] == BEGIN:
                found = start_difference(each.stock, expected[0], got[0], read_terrain(batch, i))
            if found is not None:
                report.difference = (
                    f"{where}{each.name}, episode {each.episode}, step {time_before}: {found}"
                )
                return report
    report.add_coverage(batch.coverage())
    return report


SEEDS_OF_A_JOB = 3


def compare_job(name: str, first_seed: int) -> tuple[str, Report]:
    seeds = range(first_seed, first_seed + SEEDS_OF_A_JOB)
    return name, compare(CONFIGURATIONS[name], seeds, where=f"{name}, ")


def survey(num_steps: int, first_seed: int = 0) -> dict[str, Report]:
    """All policies in all configurations, on all cores, for at least `num_steps` steps."""
    reports = {name: Report() for name in CONFIGURATIONS}
    jobs = (
        (name, seed)
        for seed in itertools.count(first_seed, SEEDS_OF_A_JOB)
        for name in CONFIGURATIONS
    )
    num_workers = os.cpu_count() or 1
    console = Console(stderr=True)
    columns = (TextColumn("steps"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with (
        Progress(*columns, console=console, disable=not console.is_terminal) as progress,
        ProcessPoolExecutor(num_workers, multiprocessing.get_context("spawn")) as pool,
    ):
        task = progress.add_task("", total=num_steps)
        total = 0
        running = set()
        while total < num_steps or running:
            while total < num_steps and len(running) < num_workers:
                running.add(pool.submit(compare_job, *next(jobs)))
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for name, report in (future.result() for future in done):
                reports[name].add(report)
                total += report.steps
                if report.difference is not None:
                    num_steps = 0  # no more jobs
            progress.update(task, completed=min(total, num_steps))
    return reports


def summary(reports: dict[str, Report]) -> str:
    lines = []
    total = Report()
    for name, report in reports.items():
        outcomes = ", ".join(f"{n} {what}" for what, n in report.outcomes.most_common())
        lines.append(
            f"{name:18} {report.steps:>10,} steps {report.episodes:>6,} episodes  {outcomes}"
        )
        total.add(report)
    lines += ["", *(f"{what:28} {count:>12,}" for what, count in total.coverage.items()), ""]
    lines.append(f"{total.steps:,} steps compared, {simd()}")
    differences = [report.difference for report in reports.values() if report.difference]
    return "\n".join(lines + (differences or ["no difference"])) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("num_steps", type=int, help="how many steps to compare at least")
    parser.add_argument("--first-seed", type=int, default=0, help="the environments' first seed")
    arguments = parser.parse_args()
    if arguments.num_steps < 1:
        parser.error(f"num_steps = {arguments.num_steps}: must be at least 1")
    if arguments.first_seed < 0:
        parser.error(f"--first-seed = {arguments.first_seed}: must be 0 or more")
    reports = survey(arguments.num_steps, arguments.first_seed)
    sys.stdout.write(summary(reports))
    return int(any(report.difference for report in reports.values()))


if __name__ == "__main__":
    sys.exit(main())
