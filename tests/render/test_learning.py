from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from finished_runs import flight
from touchdown.core.errors import UserError
from touchdown.render.learning import MOST_PANELS, write_learning
from touchdown.render.scene import Scene


def flights(count: int, steps: int = 3):
    points = tuple((0.0, 1.0 - 0.2 * step) for step in range(steps + 1))
    return [flight(points) for _ in range(count)]


@pytest.mark.parametrize(("count", "columns", "rows"), [(1, 1, 1), (2, 2, 1), (5, 3, 2), (9, 3, 3)])
def test_flights_are_side_by_side_in_a_nearly_square_film(tmp_path, count, columns, rows):
    path = tmp_path / "film.gif"
    write_learning(flights(count), path)
    with Image.open(path) as film:
        assert film.n_frames > 1
        width, height = film.size
    assert (round(width / 302), round(height / 233)) == (columns, rows)


def test_a_shorter_flight_stays_at_its_end_with_its_outcome(tmp_path):
    path = tmp_path / "film.gif"
    write_learning([*flights(1, steps=2), *flights(1, steps=60)], path)
    with Image.open(path) as film:
        film.seek(film.n_frames // 2)
        middle = np.asarray(film.convert("RGB"), int)
        film.seek(film.n_frames - 1)
        last = np.asarray(film.convert("RGB"), int)
    left = abs(middle[:, :300] - last[:, :300]).max()
    right = abs(middle[:, 302:] - last[:, 302:]).max()
    assert left < 60 < right  # the palette is not exact


@pytest.mark.parametrize(("name", "stride"), [("film.gif", 8), ("film.mp4", 4)])
def test_no_burn_of_an_engine_is_missing_from_the_film(tmp_path, monkeypatch, name, stride):
    seen = set()
    frame = Scene.frame

    def noted(self, step, since):
        seen.add((since, step))
        return frame(self, step, since)

    monkeypatch.setattr(Scene, "frame", noted)
    write_learning(flights(1, steps=21), tmp_path / name)
    steps = [*range(0, 21, stride), 21]
    assert set(pairwise([0, *steps])) <= seen


def test_the_film_can_be_mp4(tmp_path):
    path = tmp_path / "film.mp4"
    write_learning(flights(2), path)
    assert path.read_bytes()[4:8] == b"ftyp"


def test_other_suffixes_and_numbers_are_refused(tmp_path):
    with pytest.raises(UserError, match=r"must end in \.gif or \.mp4"):
        write_learning(flights(1), tmp_path / "film.avi")
    for count in (0, MOST_PANELS + 1):
        with pytest.raises(ValueError, match=f"flights: {count}, must be from 1 to {MOST_PANELS}"):
            write_learning(flights(count), tmp_path / "film.gif")
