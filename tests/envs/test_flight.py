import dataclasses
import io
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image
from safetensors.numpy import save

from single_changes import is_refused_in_a_line, single_changes
from stepping import Always
from touchdown.core.errors import UserError
from touchdown.envs.flight import Flight, load_flights, save_flights
from touchdown.envs.recorder import record_flight
from touchdown.evaluation.evaluator import Evaluator
from touchdown.lander import engine as engines
from touchdown.policies.baselines import HeuristicPolicy

START = 2_000_003
LANDER = "LunarLander-v3"


@pytest.fixture(scope="module")
def landing() -> Flight:
    return record_flight(HeuristicPolicy(), LANDER, START, "heuristic")


@pytest.fixture(scope="module")
def balancing() -> Flight:
    return record_flight(Always(1), "CartPole-v1", START, "right")


def assert_same(one: Flight, other: Flight) -> None:
    for field in dataclasses.fields(Flight):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if field.name == "terrain" and a is not None:
            for mine, theirs in zip(a, b, strict=True):
                assert_array_equal(mine, theirs)
        elif isinstance(a, np.ndarray):
            assert_array_equal(a, b, strict=True)
        else:
            assert a == b


def test_flight_is_what_an_evaluation_reports_of_the_same_start(landing):
    evaluator = Evaluator(LANDER, num_envs=1)
    (result,) = evaluator.rollout(HeuristicPolicy(), [START])
    evaluator.close()
    assert landing.episode_return == result.episode_return
    assert (landing.steps, landing.outcome) == (result.steps, result.outcome)
    assert landing.fuel == result.fuel
    assert landing.outcome == "landed"


def test_both_engines_record_the_same_flight(monkeypatch):
    flown = []
    for engine in ("exact", "gymnasium"):
        monkeypatch.setattr(engines, "engine_in_use", lambda engine=engine: engine)
        flown.append(record_flight(HeuristicPolicy(), LANDER, START, "heuristic"))
    ours, stock = flown
    for name in ("observations", "actions", "rewards", "bodies"):
        assert getattr(ours, name).tobytes() == getattr(stock, name).tobytes()
    assert (ours.outcome, ours.fuel) == (stock.outcome, stock.fuel)
    for mine, theirs in zip(ours.terrain, stock.terrain, strict=True):
        assert_array_equal(mine, theirs)


def test_the_engine_s_flights_are_flown_and_filmed_without_box2d_and_pygame(tmp_path):
    script = f"""
import sys
from pathlib import Path

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("Box2D", "pygame"):
            raise ImportError(name)

sys.meta_path.insert(0, Missing())
import touchdown
touchdown.fly("pid", seed=3, out={str(tmp_path / "pid.gif")!r})
"""
    subprocess.run([sys.executable, "-c", script], check=True)
    assert (tmp_path / "pid.gif").stat().st_size > 10_000


def test_returns_grow_from_zero_by_each_reward(landing):
    assert landing.returns[0] == 0
    assert landing.returns.shape == (landing.steps + 1,)
    assert_allclose(np.diff(landing.returns), landing.rewards, atol=1e-9)
    assert landing.returns[-1] == landing.episode_return


def test_hull_is_where_the_observations_say(landing):
    hull = landing.bodies[:, 0].astype(np.float64)
    rest = landing.terrain.helipad_y + 18 / 30  # the hull's height when its legs stand on the pad
    seen = landing.observations
    assert_allclose(seen[:, 0], (hull[:, 0] - 10) / 10, atol=1e-6)
    assert_allclose(seen[:, 1], (hull[:, 1] - rest) / (400 / 30 / 2), atol=1e-6)
    assert_allclose(seen[:, 4], hull[:, 2], atol=1e-6)


def test_legs_stay_beside_the_hull(landing):
    assert landing.bodies.shape == (landing.steps + 1, 3, 3)
    for leg in (1, 2):
        distances = np.hypot(*(landing.bodies[:, leg, :2] - landing.bodies[:, 0, :2]).T)
        assert 0.4 < distances.min() <= distances.max() < 1.2


def test_terrain_spans_the_viewport_and_is_flat_between_the_flags(landing):
    terrain = landing.terrain
    assert (terrain.xs[0], terrain.xs[-1], len(terrain.xs)) == (0, 20, 11)
    assert (terrain.helipad_x1, terrain.helipad_x2) == (8, 12)
    pad = terrain.heights[(terrain.xs >= 8) & (terrain.xs <= 12)]
    assert_allclose(pad, 0.99 * terrain.helipad_y)  # upstream smooths with 0.33 for a third


def test_another_environment_is_recorded_with_pictures_of_its_own(balancing):
    assert balancing.bodies is None
    assert balancing.terrain is None
    assert len(balancing.frames) == balancing.steps + 1
    sizes = {Image.open(io.BytesIO(frame)).size for frame in balancing.frames}
    assert sizes == {(600, 400)}
    assert balancing.outcome == "terminated"
    assert balancing.episode_return == balancing.steps
    assert balancing.fuel == 0


def test_drawing_without_a_display_leaves_the_environment_as_it_was(monkeypatch):
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    record_flight(Always(0), "CartPole-v1", START, "left")
    assert "SDL_VIDEODRIVER" not in os.environ
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    record_flight(Always(0), "CartPole-v1", START, "left")
    assert os.environ["SDL_VIDEODRIVER"] == "dummy"


def test_an_unknown_environment_is_refused():
    with pytest.raises(UserError, match="NoSuchEnv-v0"):
        record_flight(Always(0), "NoSuchEnv-v0", START, "left")


def test_saved_flights_load_identically(tmp_path, landing, balancing):
    path = tmp_path / "flights.safetensors"
    falling = record_flight(Always(0), LANDER, START + 1, "falling, “ä”")
    save_flights(path, [landing, falling, balancing])
    loaded = load_flights(path)
    assert [flight.policy for flight in loaded] == ["heuristic", "falling, “ä”", "right"]
    for before, after in zip([landing, falling, balancing], loaded, strict=True):
        assert_same(before, after)


@pytest.mark.parametrize("kept", [0.0, 0.001, 0.1, 0.5, 0.999])
def test_cut_off_file_is_refused_in_one_line(tmp_path, landing, kept):
    path = tmp_path / "flights.safetensors"
    save_flights(path, [landing])
    data = path.read_bytes()
    path.write_bytes(data[: int(kept * len(data))])
    with pytest.raises(UserError, match=r"flights\.safetensors: not a complete") as raised:
        load_flights(path)
    assert "\n" not in str(raised.value)


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(UserError, match="cannot be read: No such file"):
        load_flights(tmp_path / "none.safetensors")


def test_missing_folder_is_refused(tmp_path, landing):
    with pytest.raises(UserError, match="cannot be written: No such file"):
        save_flights(tmp_path / "none" / "flights.safetensors", [landing])


def flights_file(path, metadata: dict[str, str], **changed: np.ndarray) -> None:
    tensors = {
        "0.observations": np.zeros((3, 8), np.float32),
        "0.actions": np.zeros(2, np.int64),
        "0.rewards": np.zeros(2),
    }
    path.write_bytes(save(tensors | {f"0.{name}": it for name, it in changed.items()}, metadata))


FACTS = {
    "env_id": LANDER,
    "pilot": "p",
    "seed": 1,
    "outcome": "landed",
    "steps_per_second": 50,
}


def test_smallest_file_is_read(tmp_path):
    path = tmp_path / "flights.safetensors"
    flights_file(path, {"format_version": "1", "flights": json.dumps([FACTS])})
    (flight,) = load_flights(path)
    assert flight.steps == 2


@pytest.mark.parametrize(
    ("metadata", "reason"),
    [
        ({}, "format_version = None"),
        ({"format_version": "2", "flights": "[]"}, "format_version = '2'"),
        ({"format_version": "1"}, "not recorded flights"),
        ({"format_version": "1", "flights": "[{"}, "not recorded flights"),
        ({"format_version": "1", "flights": "[3]"}, "not recorded flights"),
        ({"format_version": "1", "flights": json.dumps([FACTS, FACTS])}, "not recorded flights"),
        (
            {"format_version": "1", "flights": json.dumps([FACTS | {"outcome": "flew off"}])},
            "outcome = 'flew off'",
        ),
    ],
)
def test_file_that_holds_something_else_is_refused(tmp_path, metadata, reason):
    path = tmp_path / "flights.safetensors"
    flights_file(path, metadata)
    with pytest.raises(UserError, match=reason):
        load_flights(path)


def test_one_wrong_value_in_the_facts_is_reported_in_one_line(tmp_path):
    path = tmp_path / "flights.safetensors"
    refused = 0
    for other in single_changes([FACTS]):
        flights_file(path, {"format_version": "1", "flights": json.dumps(other)})
        refused += is_refused_in_a_line(
            lambda: load_flights(path), f"{path}: not recorded flights: "
        )
    assert refused > 50


@pytest.mark.parametrize(
    "changed",
    [
        {"rewards": np.zeros(3)},
        {"observations": np.zeros((2, 8), np.float32)},
        {"bodies": np.zeros((2, 3, 3), np.float32)},
        {"frames": np.zeros(9, np.uint8), "frame_sizes": np.array([3, 6])},
        {"frames": np.zeros(9, np.uint8), "frame_sizes": np.array([3, 3, 4])},
        {"terrain": np.zeros((2, 11)), "helipad": np.zeros(2)},
        *(
            {
                "frames": np.zeros(9, np.uint8),
                "frame_sizes": np.array([3, 6]),
                "frame_steps": np.array(wrong),
            }
            for wrong in ([0, 1], [1, 2], [[0, 2]], [0, 5, 2], [], [0, 1, 2])
        ),
    ],
)
def test_file_whose_lengths_disagree_is_refused(tmp_path, changed):
    path = tmp_path / "flights.safetensors"
    metadata = {"format_version": "1", "flights": json.dumps([FACTS])}
    flights_file(path, metadata, **changed)
    with pytest.raises(UserError, match="not recorded flights"):
        load_flights(path)


def test_a_flight_is_told_in_a_line(landing):
    assert repr(landing) == (
        f"<Flight heuristic: LunarLander-v3 from start {START}, {landing.outcome}, "
        f"return {landing.episode_return:.1f}, {landing.steps} steps>"
    )
    renamed = dataclasses.replace(landing, policy="two\nlines")
    assert repr(renamed).startswith("<Flight two\\nlines: ")
