"""Compare flights on the browser's engine with the native engine, byte by byte.

The tests run some of this; `make web-exact` runs more.
"""

import argparse
import base64
from collections.abc import Iterator
from itertools import cycle, islice
from typing import Any, NamedTuple

import numpy as np
import pytest
from javascript import ACE, MODULE, encoded, in_browser, in_node
from rich.console import Console

from chromium import chromium
from touchdown.envs.outcome import outcome_of
from touchdown.lander.rules import fuel_of
from touchdown.lander.single import LanderEnv

FLIGHTS = "flights.js"
POLICIES = ("random", "heuristic", "ace", "pid")
SETTINGS = (
    {},
    {"gravity": -3.7},
    {"enableWind": True},
    {"gravity": -11.9, "enableWind": True, "windPower": 20.0, "turbulencePower": 2.0},
    {"gravity": -0.5},
)
_SOME = 100  # flights in one call


class Flown(NamedTuple):
    """What both engines say of one episode; equal if all of it is."""

    observations: bytes
    rewards: bytes
    ends: bytes
    facts: dict[str, Any]


class Comparison(NamedTuple):
    """Flights compared, and those that differ."""

    episodes: int
    steps: int
    differing: list[dict[str, Any]]
    outcomes: set[str]
    steps_per_second: int


def jobs(count: int) -> list[dict[str, Any]]:
    """Policies and settings in all combinations, with seeds of one and of two words."""
    pairs = cycle((policy, settings) for settings in SETTINGS for policy in POLICIES)
    return [
        {
            "policy": policy,
            "settings": settings,
            "seed": number * 2**33 if number % 7 == 3 else number,
        }
        for number, (policy, settings) in enumerate(islice(pairs, count))
    ]


def request(flown: list[dict[str, Any]]) -> dict[str, Any]:
    """What flights.js needs to fly these."""
    return {"module": encoded(MODULE), "weights": encoded(ACE), "jobs": flown}


def native(job: dict[str, Any], actions: np.ndarray) -> Flown:
    """The same episode on the native engine."""
    names = {"enableWind": "enable_wind", "windPower": "wind_power"}
    names["turbulencePower"] = "turbulence_power"
    settings = {names.get(name, name): value for name, value in job["settings"].items()}
    env = LanderEnv(max_episode_steps=1000, **settings)
    observation, _ = env.reset(seed=job["seed"])
    observations, rewards, ends = [observation], [], []
    terminated = False
    for action in actions:
        observation, reward, terminated, truncated, _ = env.step(action)
        observations.append(observation)
        rewards.append(reward)
        ends.append(terminated + 2 * truncated)
    states, (xs, heights) = env.states(), env.terrain().T
    bodies = np.concatenate((states.positions[0], states.angles[0][:, None]), axis=1)
    left, right, height = env.helipad
    outcome = outcome_of("LunarLander-v3", observation, rewards[-1], terminated=terminated)
    facts = {
        "steps": len(actions),
        "episodeReturn": float(np.cumsum(rewards)[-1]),
        "fuel": pytest.approx(fuel_of(actions)),
        "outcome": outcome,
        "bodies": bodies.ravel().tolist(),
        "terrain": {
            "xs": xs.tolist(),
            "heights": heights.tolist(),
            "helipadX1": left,
            "helipadX2": right,
            "helipadY": height,
        },
    }
    return Flown(np.array(observations).tobytes(), np.array(rewards).tobytes(), bytes(ends), facts)


def compare(answer: dict[str, Any], flown: list[dict[str, Any]]) -> Comparison:
    """What JavaScript answers to a request, with the native engine."""
    steps, differing, outcomes = 0, [], set()
    for job, episode in zip(flown, answer["episodes"], strict=True):
        arrays = {
            name: base64.b64decode(episode[name])
            for name in ("actions", "observations", "rewards", "ends")
        }
        actions = np.frombuffer(arrays.pop("actions"), np.uint8)
        if Flown(**arrays, facts=episode["facts"]) != native(job, actions):
            differing.append(job)
        outcomes.add(episode["facts"]["outcome"])
        steps += len(actions)
    return Comparison(len(flown), steps, differing, outcomes, answer["stepsPerSecond"])


def batched(flown: list[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    """Parts that a page can answer in one piece."""
    for first in range(0, len(flown), _SOME):
        yield flown[first : first + _SOME]


def main() -> None:
    """Compare as many flights as asked for in Chromium and in Node, and print the differences."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("episodes", type=int, help="number of episodes")
    count = parser.parse_args().episodes
    say = Console(highlight=False, soft_wrap=True).print
    say(f"lander.wasm: {MODULE.stat().st_size:,} bytes")
    with chromium() as browser:
        places = {
            "Chromium": lambda asked: in_browser(browser, FLIGHTS, "answer", asked),
            "Node": lambda asked: in_node(FLIGHTS, "answer", asked),
        }
        for place, answer in places.items():
            parts = [compare(answer(request(some)), some) for some in batched(jobs(count))]
            say(
                f"{place}: {sum(part.episodes for part in parts):,} episodes, "
                f"{sum(part.steps for part in parts):,} steps, "
                f"{sum(len(part.differing) for part in parts)} episodes differ; "
                f"{max(part.steps_per_second for part in parts):,} steps/s"
            )


if __name__ == "__main__":
    main()
