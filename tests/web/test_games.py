"""The playground's games: what a person does, links that repeat it, and the engine's flights."""

from base64 import b64decode
from typing import Any

import numpy as np
import pytest
from javascript import ACE, MODULE, encoded, in_node
from numpy.testing import assert_array_equal

from touchdown.lander.single import LanderEnv

AUTOPILOT, MAIN_AND_LEFT, MAIN_AND_RIGHT = 4, 5, 6
ROUGH = "wind=15&turbulence=1.5&faults=0.2&noise=0.05&gravity=9"


def play(*games: tuple[str, list[tuple[str, int]]]) -> list[dict[str, Any]]:
    request = {
        "module": encoded(MODULE),
        "ace": encoded(ACE),
        "games": [{"link": link, "script": script} for link, script in games],
    }
    return in_node("games.js", "play", request)


def hold(command: int, steps: int) -> tuple[str, int]:
    return "hold", 1000 * command + steps


def observations_of(flight: dict[str, Any]) -> np.ndarray:
    return np.frombuffer(b64decode(flight["observations"]), np.float32).reshape(-1, 8)


def test_commands_become_short_text_and_come_back():
    rng = np.random.default_rng(0)
    scripts = [
        np.repeat(rng.integers(0, 7, runs), rng.integers(1, most, runs)).tolist()[:1000]
        for runs in (0, 1, 2, 50)
        for most in (2, 40, 1001)
    ]
    answers = in_node("games.js", "roundTrips", [{"commands": each} for each in scripts])
    assert [each["commands"] for each in answers] == scripts
    # ten changes of a person's mind in a second, over a flight of 20 s
    person = np.repeat(rng.integers(0, 7, 200), 5).tolist()
    (answer,) = in_node("games.js", "roundTrips", [{"commands": person}])
    assert len(answer["text"]) <= 200 * 4 / 3 + 4


@pytest.mark.parametrize(
    ("link", "said"),
    [
        ("start=-1", "start -1 is not a whole number from 0 to 2147483647"),
        ("start=1e3", "start 1e3 is not"),
        ("start=2147483648", "start 2147483648 is not"),
        ("start=1&gravity=12", "gravity 12 is not a number from 0.5 to 11.9"),
        ("start=1&wind=strong", "wind strong is not a number from 0 to 20"),
        ("start=1&flight=A*", "the flight in this link is damaged"),
        ("start=1&flight=AAAAA", "the flight in this link is damaged"),
        ("start=1&flight=gA", "the flight in this link is damaged"),
        ("start=1&flight=gICA", "the flight in this link is damaged"),
        ("start=1&flight=___f", "the flight in this link is damaged"),
    ],
)
def test_a_damaged_link_is_refused_in_words(link, said):
    (answer,) = in_node("games.js", "readings", [link])
    assert isinstance(answer, str)
    assert answer.startswith(said)


def test_a_link_says_what_determines_the_flights_and_nothing_else():
    text = "#start=3&by=you&autopilot=pid&against=ace&against=a%26b&wind=2.5&flight=GQ&check=x"
    plain, full = in_node("games.js", "readings", ["", text])
    assert plain is None  # nothing to open
    assert full == {
        "setup": {
            "seed": 3,
            "byHand": True,
            "autopilot": "pid",
            "rivals": ["ace", "a&b"],
            "conditions": {"gravity": 10, "wind": 2.5, "turbulence": 0, "faults": 0, "noise": 0},
        },
        "commands": [4] * 4,  # 25 = 4 + 7 · 3
        "check": "x",
    }


def test_engines_take_turns_when_two_are_held():
    (game,) = play(("start=7&autopilot=ace", [hold(MAIN_AND_LEFT, 4), hold(MAIN_AND_RIGHT, 3)]))
    assert game["flights"][0]["actions"] == [2, 1, 2, 1, 2, 3, 2]


def test_flights_are_those_of_the_native_engine_under_the_same_conditions():
    script = [hold(2, 30), ("release", 10), hold(MAIN_AND_RIGHT, 25), ("frames", 16)]
    (game,) = play((f"start=11&by=you&autopilot=ace&against=pid&{ROUGH}", script))
    for flight in game["flights"]:
        env = LanderEnv(
            gravity=-9,
            enable_wind=True,
            wind_power=15,
            turbulence_power=1.5,
            max_episode_steps=1000,
        )
        seen, total = [env.reset(seed=11)[0]], 0.0
        for action in flight["actions"]:
            observation, reward, terminated, truncated, _ = env.step(action)
            seen.append(observation)
            total += float(reward)
        assert terminated or truncated
        assert observations_of(flight).tobytes() == np.array(seen).tobytes()
        assert flight["returns"][-1] == pytest.approx(total, abs=1e-9)


def test_a_link_repeats_a_flight_to_the_last_bit_whatever_the_person_did():
    link = f"start=5&by=you&autopilot=ace&against=ace&against=random&{ROUGH}"
    script = [
        *(hold(2, 20), ("release", 7), hold(1, 9), hold(MAIN_AND_LEFT, 11), ("seek", 25)),
        *(hold(3, 12), ("autopilot", 0), ("release", 30), hold(2, 5), ("step", 2), ("frames", 7)),
    ]
    (first,) = play((link, script))
    assert first["flownBy"] == "you + ace"
    commands = first["flights"][0]["commands"]
    assert commands[:37] == [2] * 20 + [0] * 5 + [3] * 12  # what was rewound is forgotten
    again, slower = play((first["link"], [("frames", 17)]), (first["link"], [("frames", 4)]))
    assert again["link"] == slower["link"] == first["link"]  # with the same check
    for game in (again, slower):
        assert game["flights"] == first["flights"]
    assert {flight["name"] for flight in first["flights"]} == {"ace", "random"}
    assert all(flight["outcome"] for flight in first["flights"])


def test_a_rewound_flight_goes_on_as_one_that_was_never_longer():
    link = f"start=2&by=you&autopilot=random&{ROUGH}"
    detour = [hold(2, 40), ("autopilot", 0), ("release", 20), ("seek", 15), hold(3, 1)]
    straight = [hold(2, 15), ("autopilot", 0), hold(3, 1)]
    rewound, plain = play((link, [*detour, ("frames", 20)]), (link, [*straight, ("frames", 20)]))
    assert rewound["flights"] == plain["flights"]
    assert rewound["link"] == plain["link"]


def test_a_shared_flight_that_is_not_over_is_handed_to_the_next_person():
    (first,) = play(("start=7&by=you&autopilot=ace", [hold(2, 30)]))
    handed, done = play(
        (first["link"], [("frames", 20)]), (first["link"], [("frames", 20), hold(1, 10)])
    )
    assert handed["events"][-1] == "handed over"
    assert handed["step"] == 30
    assert done["flights"][0]["commands"] == [2] * 30 + [1] * 10


def test_the_autopilot_lands_and_a_person_may_override_it():
    lands, meddled = play(
        ("start=7&by=ace", [("frames", 16)]),
        ("start=7&by=ace", [("release", 10), hold(1, 5), ("frames", 16)]),
    )
    assert lands["events"] == ["started", "changed", "ended"]
    assert lands["flownBy"] == "ace"
    assert lands["flights"][0]["outcome"] == "landed"
    assert lands["flights"][0]["returns"][-1] > 200
    commands = meddled["flights"][0]["commands"]
    assert commands[:16] == [AUTOPILOT] * 10 + [1] * 5 + [AUTOPILOT]
    assert meddled["flownBy"] == "you + ace"


def test_faults_and_noise_are_drawn_from_the_start_and_have_the_chosen_strength():
    asked = {"faults": 0.3, "noise": 0.1, "steps": 2000}
    rows = in_node("games.js", "disturbances", asked | {"seed": 1})
    same = in_node("games.js", "disturbances", asked | {"seed": 1})
    other = in_node("games.js", "disturbances", asked | {"seed": 2})
    assert rows == same != other
    idle, main = np.array([row["actions"] for row in rows]).T
    assert_array_equal(idle, 0)
    assert abs(np.mean(main == 0) - 0.3) < 4 * np.sqrt(0.3 * 0.7 / 2000)
    seen = np.array([row["seen"] for row in rows])
    assert_array_equal(seen[:, 6:], [[1, 0]] * 2000)  # contacts are no measurements
    measured = seen[:, :6] / 0.1
    assert np.abs(measured.mean(0)).max() < 4 / np.sqrt(2000)
    assert np.abs(measured.std(0) - 1).max() < 4 / np.sqrt(2 * 2000)
    assert np.abs(np.corrcoef(measured.T) - np.eye(6)).max() < 5 / np.sqrt(2000)


def test_a_page_that_was_hidden_does_not_catch_up():
    (game,) = play(("start=7&by=ace", [("release", 50), ("tick", 3_600_000)]))
    assert 50 < game["step"] <= 55
