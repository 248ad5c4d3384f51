import dataclasses
import io
import subprocess
import sys
from itertools import pairwise

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from stepping import Always
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.core.types import Outcome
from touchdown.envs import environment
from touchdown.envs.flight import Flight, Terrain
from touchdown.envs.recorder import record_flight
from touchdown.lander.rules import IDLE, LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE
from touchdown.policies.baselines import HeuristicPolicy
from touchdown.render import film as films
from touchdown.render.canvas import Canvas
from touchdown.render.dashboard import OUTCOME_COLOURS, velocity
from touchdown.render.scene import Scene
from touchdown.render.sprite import FLAME, PUFF

LANDER = "LunarLander-v3"
COLUMN, ROW = 300, 160  # of the hull that `hovering` holds in place, on the 600-pixel picture


def hovering(*actions: int, outcome: Outcome = "timed out") -> Flight:
    """Upright and still at x = 10, y = 8 over a flat moon, regardless of the engines."""
    steps = len(actions)
    body = [[10, 8, 0], [10.7, 7.7, -0.1], [9.3, 7.7, 0.1]]
    return Flight(
        env_id=LANDER,
        policy="still",
        seed=2_000_000,
        observations=np.zeros((steps + 1, 8), np.float32),
        actions=np.array(actions, np.int64),
        rewards=np.ones(steps),
        outcome=outcome,
        steps_per_second=50,
        bodies=np.tile(np.array(body, np.float32), (steps + 1, 1, 1)),
        terrain=Terrain(np.linspace(0, 20, 11), np.full(11, 3.3), 8.0, 12.0, 10 / 3),
    )


def near(image: Image.Image, colour: tuple[int, int, int]) -> np.ndarray:
    """Rows and columns of the pixels above the dashboard of nearly this colour: [n, 2]."""
    pixels = np.asarray(image)[:400].astype(int)
    return np.argwhere(np.abs(pixels - colour).max(-1) < 12)


@pytest.fixture(scope="module")
def landing() -> Flight:
    return record_flight(HeuristicPolicy(), LANDER, 2_000_003, "heuristic")


@pytest.fixture(scope="module")
def balancing() -> Flight:
    return record_flight(Always(1), "CartPole-v1", 2_000_003, "right")


def shortened(flight: Flight, steps: int) -> Flight:
    return dataclasses.replace(
        flight,
        observations=flight.observations[: steps + 1],
        actions=flight.actions[:steps],
        rewards=flight.rewards[:steps],
        bodies=flight.bodies[: steps + 1],
    )


def drawn(
    *colours: str,
    steps_per_second: float,
    frame_steps: list[int] | None = None,
    size: tuple[int, int] = (6, 4),
) -> Flight:
    """A flight of another environment, a colour a picture."""
    pngs = []
    for colour in colours:
        png = io.BytesIO()
        Image.new("RGB", size, colour).save(png, "PNG")
        pngs.append(png.getvalue())
    return dataclasses.replace(
        hovering(*[IDLE] * (frame_steps[-1] if frame_steps else len(colours) - 1)),
        bodies=None,
        steps_per_second=steps_per_second,
        frames=tuple(pngs),
        frame_steps=None if frame_steps is None else np.array(frame_steps),
    )


def video_stream(path) -> str:
    """The description of a file's video by ffmpeg."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path)]
    said = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False).stderr
    (line,) = (line for line in said.splitlines() if "Video:" in line)
    return line


def test_main_flame_burns_below_the_hull_and_only_when_the_engine_fires():
    scene = Scene(hovering(IDLE, MAIN_ENGINE))
    idle, firing = (near(scene.frame(step), FLAME[0]) for step in (1, 2))
    assert len(idle) == 0
    assert len(firing) > 30
    assert firing[:, 0].min() > ROW + 10  # the hull's lower edge
    assert abs(firing[:, 1].mean() - COLUMN) < 2


@pytest.mark.parametrize(("engine", "side"), [(LEFT_ENGINE, 1), (RIGHT_ENGINE, -1)])
def test_side_engine_blows_away_from_where_it_pushes(engine, side):
    puff = near(Scene(hovering(engine)).frame(1), PUFF[0])
    assert len(puff) > 10
    assert (side * (puff[:, 1] - COLUMN)).min() > 10
    assert puff[:, 0].mean() < ROW  # beside the cabin
    env = environment.make_env().env
    sideways = []
    for action in (IDLE, engine):
        env.reset(seed=2_000_000)
        observation, *_ = env.step(action)
        sideways.append(observation[2])
    env.close()
    assert np.sign(sideways[1] - sideways[0]) == -side


def test_flame_ends_at_the_ground():
    high, low = hovering(MAIN_ENGINE), hovering(MAIN_ENGINE)
    low.bodies[:, :, 1] += 3.3 + 1.0 - 8
    reach = []
    for flight in (high, low):
        flame = near(Scene(flight).frame(1), FLAME[0])
        hull = (400 / 30 - flight.bodies[1, 0, 1]) * 30
        reach.append(flame[:, 0].max() - hull)
    assert reach[0] > 45
    assert reach[1] < 31


def test_burn_between_two_pictures_is_not_left_out():
    flight = hovering(MAIN_ENGINE, IDLE, IDLE, IDLE)
    images = [picture.image for picture in films.pictures(flight, fps=25)]
    assert [len(near(image, FLAME[0])) > 0 for image in images] == [False, True, False]


def test_picture_of_a_step_is_always_the_same(landing):
    one, other = (Scene(landing).frame(40).tobytes() for _ in range(2))
    assert one == other


def test_lander_flies_in_front_of_the_same_sky_from_the_same_start():
    here, there = hovering(IDLE), hovering(IDLE)
    there.bodies[:, :, 0] += 5
    changed = np.asarray(Scene(here).frame(1)) != np.asarray(Scene(there).frame(1))
    columns = np.flatnonzero(changed[:400].any((0, 2)))
    assert columns.min() > COLUMN - 45
    assert columns.max() < COLUMN + 150 + 45


def test_trail_leads_from_the_start_to_the_lander():
    flight = hovering(*[IDLE] * 50)
    flight.bodies[:, :, 0] += np.linspace(-8, 0, 51)[:, None]
    scene = Scene(flight)
    before, after = (np.asarray(scene.frame(step)).astype(int) for step in (0, 50))
    row = (after - before)[ROW, 100 : COLUMN - 40].sum(-1)
    assert (row > 0).mean() > 0.9
    assert row[-20:].mean() > row[:20].mean()  # it fades


def test_lander_above_the_picture_has_a_marker():
    seen, lost = hovering(IDLE), hovering(IDLE)
    lost.bodies[:, :, 1] += 9
    pointer = near(Scene(lost).frame(1), (240, 243, 250))
    assert ((pointer[:, 0] < 16) & (abs(pointer[:, 1] - COLUMN) < 8)).sum() > 20
    title_only = near(Scene(seen).frame(1), (240, 243, 250))
    assert not ((title_only[:, 0] < 16) & (abs(title_only[:, 1] - COLUMN) < 8)).any()


def test_lander_far_above_and_aside_still_draws():
    flight = hovering(IDLE, IDLE)
    flight.bodies[:, :, 1] += 30
    flight.bodies[:, :, 0] += 15
    assert Scene(flight).frame(2).size == (600, 450)


def test_velocity_is_in_metres_per_second(landing):
    for step in (20, 60):
        moved = (landing.bodies[step + 1, 0, :2] - landing.bodies[step, 0, :2]) * 50
        # the position moves by the velocity after the step, up to the solver's correction
        np.testing.assert_allclose(velocity(landing, step + 1), moved, atol=0.02)


@pytest.mark.parametrize("outcome", ["landed", "crashed", "out of bounds", "timed out"])
def test_outcome_is_written_on_the_last_picture_alone(outcome):
    flight = hovering(IDLE, IDLE, IDLE, outcome=outcome)
    images = [picture.image for picture in films.pictures(flight)]
    *before, last = (len(near(image, OUTCOME_COLOURS[outcome])) for image in images)
    assert len(set(before)) == 1  # other pixels of the colour, such as the flags
    assert last > before[0] + 1000


def test_last_picture_is_held_and_the_rest_run_in_real_time(landing):
    flight = shortened(landing, 7)
    seconds = [picture.seconds for picture in films.pictures(flight, fps=25)]
    assert seconds == [0.04] * 4 + [films.HOLD_SECONDS]  # steps 0, 2, 4, 6 and 7


def test_gif_has_every_second_step_in_real_time(tmp_path, landing):
    path = tmp_path / "landing.gif"
    films.write_video(landing, path)
    assert path.stat().st_size < 3_000_000
    with Image.open(path) as film:
        assert film.size == (600, 450)
        assert film.info["loop"] == 0
        assert film.n_frames == len(range(0, landing.steps, 2)) + 1
        durations = []
        for frame in range(film.n_frames):
            film.seek(frame)
            durations.append(film.info["duration"])
    assert durations == [40] * (film.n_frames - 1) + [1200]


def test_gif_shows_what_was_drawn(tmp_path, landing):
    path = tmp_path / "landing.gif"
    flight = shortened(landing, 40)
    films.write_gif(flight, path)
    scene = Scene(flight)
    with Image.open(path) as film:
        for frame in (0, 9, 15):
            film.seek(frame)
            shown = np.asarray(film.convert("RGB")).astype(int)
            drawn = np.asarray(scene.frame(2 * frame, max(2 * frame - 2, 0))).astype(int)
            assert np.abs(shown - drawn).mean() < 2.5
            assert np.abs(shown - drawn).max() < 80


def test_several_flights_follow_each_other(tmp_path, landing):
    path = tmp_path / "both.gif"
    films.write_video([shortened(landing, 4), shortened(landing, 6)], path)
    with Image.open(path) as film:
        assert film.n_frames == 3 + 4


def test_mp4_has_every_step_and_holds_the_last(tmp_path, landing):
    path = tmp_path / "LANDING.MP4"
    films.write_video(shortened(landing, 30), path)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert frames == 30 + 1.2 * 50
    assert seconds == pytest.approx(1.8, abs=0.03)
    stream = video_stream(path)
    assert "h264" in stream
    assert "yuv420p" in stream
    assert "900x676" in stream
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")  # it can play before it has loaded completely


def test_pictures_of_odd_size_become_an_mp4(tmp_path):
    flight = drawn(*["teal"] * 3, steps_per_second=50, size=(61, 45))
    path = tmp_path / "odd.mp4"
    films.write_video(flight, path)
    assert "62x46" in video_stream(path)


def test_two_seconds_a_step_are_shown_for_two_seconds(tmp_path):
    flight = drawn("red", "green", "blue", steps_per_second=0.5)
    assert [picture.seconds for picture in films.pictures(flight)] == [2, 2, 1.2]
    path = tmp_path / "slow.mp4"
    films.write_video(flight, path)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert (frames, seconds) == (3, 6)


@pytest.mark.parametrize("steps_per_second", [0.001, 0.01])
def test_a_film_of_hours_is_sped_up_to_ten_minutes(tmp_path, steps_per_second):
    flight = drawn(*["red"] * 12, steps_per_second=steps_per_second)
    path = tmp_path / "still.gif"
    films.write_video(flight, path)
    with Image.open(path) as film:  # one picture, as nothing changes
        assert film.info["duration"] == pytest.approx(1_000 * (films.MOST_SECONDS + 1.2), abs=200)


def test_between_its_pictures_a_thinned_flight_shows_the_one_before():
    flight = drawn("red", "green", "blue", steps_per_second=25, frame_steps=[0, 4, 6])
    assert flight.steps == 6
    colours = [picture.image.getpixel((0, 0)) for picture in films.pictures(flight)]
    assert colours == [(255, 0, 0)] * 4 + [(0, 128, 0)] * 2 + [(0, 0, 255)]


def test_another_environment_is_shown_by_its_own_frames(tmp_path, balancing):
    path = tmp_path / "balancing.gif"
    films.write_video(balancing, path)
    with Image.open(path) as film:
        assert film.size == (600, 400)
        assert film.n_frames == len(range(0, balancing.steps, 2)) + 1
    last = Image.open(io.BytesIO(balancing.frames[-1])).convert("RGB")
    assert films.poster(balancing).tobytes() == last.tobytes()


def test_flight_without_pictures_or_bodies_is_refused(balancing):
    with pytest.raises(ValueError, match="CartPole-v1"):
        films.poster(dataclasses.replace(balancing, frames=None))


def test_poster_shows_the_whole_path_and_the_outcome(landing):
    poster = films.poster(landing, 1.0)
    assert len(near(poster, OUTCOME_COLOURS["landed"])) > 100
    final = np.asarray(Scene(landing).frame(landing.steps)).astype(int)
    changed = np.abs(np.asarray(poster).astype(int) - final).sum(-1) > 30
    for step in (30, 60, 90):
        column, row = map(round, Canvas().pixel(*landing.bodies[step, 0, :2].tolist()))
        assert changed[row - 2 : row + 3, column - 2 : column + 3].any(), f"no path at {step}"


def test_poster_is_sharp_unless_told_otherwise():
    assert films.poster(hovering(IDLE)).size == (1200, 900)


@pytest.mark.parametrize("name", ["film.avi", "film", "gif"])
def test_other_suffixes_are_refused(tmp_path, landing, name):
    path = tmp_path / name
    with pytest.raises(UserError) as raised:
        films.write_video(landing, path)
    assert str(raised.value) == f"{path}: must end in .gif or .mp4"


def test_paths_that_cannot_be_written_are_refused_before_flying(tmp_path, monkeypatch):
    with pytest.raises(UserError, match="there is no folder"):
        films.check_video_path(tmp_path / "none" / "film.gif")
    (tmp_path / "folder.gif").mkdir()
    with pytest.raises(UserError, match="is a folder"):
        films.check_video_path(tmp_path / "folder.gif")
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(UserError, match="is read-only"):
        films.check_video_path(tmp_path / "film.gif")


def test_full_disk_is_reported_in_one_line_and_leaves_nothing(tmp_path, landing, monkeypatch):
    def fail(path):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(files, "sync", fail)
    path = tmp_path / "film.gif"
    path.write_bytes(b"before")
    with pytest.raises(UserError, match=r"^[^\n]*film\.gif: cannot be written: No space left"):
        films.write_video(shortened(landing, 2), path)
    assert path.read_bytes() == b"before"
    assert [file.name for file in tmp_path.iterdir()] == ["film.gif"]


def test_a_failure_of_ffmpeg_is_reported_in_one_line_and_leaves_nothing(
    tmp_path, landing, monkeypatch
):
    broken = tmp_path / "ffmpeg"
    broken.write_text("#!/bin/sh\necho 'no such\nencoder' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(broken))
    with pytest.raises(UserError, match=r"cannot be written: ffmpeg: no such encoder$"):
        films.write_video(shortened(landing, 2), tmp_path / "film.mp4")
    assert [file.name for file in tmp_path.iterdir()] == ["ffmpeg"]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
def test_window_without_a_display_is_refused_in_one_line(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(UserError, match=r"^out = window: there is no display[^\n]*$"):
        films.show_window(LANDER, HeuristicPolicy(), 2_000_003, "heuristic")


def test_window_flies_the_same_episode_as_a_recording(monkeypatch, balancing):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(films, "HOLD_SECONDS", 0)
    flight = films.show_window("CartPole-v1", Always(1), 2_000_003, "right")
    np.testing.assert_array_equal(flight.observations, balancing.observations)
    assert flight.episode_return == balancing.episode_return
    assert flight.frames is None


def test_ghosts_do_not_overlap(landing):
    places = [tuple(landing.bodies[step, 0, :2]) for step in Scene(landing).ghosts()]
    assert len(places) >= 3
    for one, other in pairwise(places):
        assert np.hypot(one[0] - other[0], one[1] - other[1]) > 1
