"""Flights on the engine in a browser have the bits of those on the native engine."""

import base64
from collections.abc import Generator
from itertools import cycle, islice
from typing import Any, NamedTuple

import numpy as np
import pytest
from javascript import ACE, MODULE, encoded, in_browser, in_node
from playwright.sync_api import Browser

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


class Flown(NamedTuple):
    """What both engines say of one episode; equal if all of it is."""

    observations: bytes
    rewards: bytes
    ends: bytes
    facts: dict[str, Any]


@pytest.fixture(scope="module")
def browser() -> Generator[Browser]:
    with chromium() as found:
        yield found


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


def request(count: int) -> dict[str, Any]:
    """What flights.js needs."""
    return {"module": encoded(MODULE), "weights": encoded(ACE), "jobs": jobs(count)}


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


def check(answer: dict[str, Any], count: int) -> None:
    outcomes = set()
    for job, episode in zip(jobs(count), answer["episodes"], strict=True):
        arrays = {
            name: base64.b64decode(episode[name])
            for name in ("actions", "observations", "rewards", "ends")
        }
        actions = np.frombuffer(arrays.pop("actions"), np.uint8)
        assert Flown(**arrays, facts=episode["facts"]) == native(job, actions), job
        outcomes.add(episode["facts"]["outcome"])
    assert outcomes == {"landed", "crashed", "out of bounds", "timed out"}


def test_flights_in_node_are_the_native_engines():
    check(in_node(FLIGHTS, "answer", request(200)), 200)


def test_flights_in_a_browser_are_the_native_engines(browser: Browser):
    check(in_browser(browser, FLIGHTS, "answer", request(60)), 60)


@pytest.mark.slow
def test_a_thousand_flights_in_a_browser_are_the_native_engines(browser: Browser):
    check(in_browser(browser, FLIGHTS, "answer", request(1000)), 1000)
