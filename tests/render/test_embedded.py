import base64
import io
import re

import pytest
from PIL import Image

from stepping import Always
from touchdown.core import notebook
from touchdown.envs.recorder import record_flight
from touchdown.render import embedded, film


def picture_in(shown: str) -> Image.Image:
    found = re.search(r'src="data:image/(\w+);base64,([^"]+)"', shown)
    assert found is not None
    picture = Image.open(io.BytesIO(base64.b64decode(found[2])))
    assert picture.format == found[1].upper()
    return picture


@pytest.fixture
def falling():
    return record_flight(Always(0), "LunarLander-v3", 3, "<script>")


def test_a_flight_shows_a_small_film_that_moves(falling):
    shown = falling._repr_html_()
    assert shown == notebook.html_of(falling)
    picture = picture_in(shown)
    assert (picture.format, picture.width) == ("GIF", 400)
    assert picture.n_frames > 10
    assert len(shown) < 500_000


def test_what_flew_is_named_without_markup(falling):
    shown = falling._repr_html_()
    assert "<script" not in shown
    assert "<figcaption>&lt;script&gt;: LunarLander-v3 from start 3, crashed" in shown


def test_the_film_is_made_once(falling, monkeypatch):
    shown = falling._repr_html_()
    monkeypatch.setattr(film, "write_gif", None)
    assert falling._repr_html_() is shown


def test_an_environment_that_draws_itself_is_filmed_too():
    flight = record_flight(Always(1), "CartPole-v1", 3, "right")
    assert picture_in(flight._repr_html_()).n_frames == flight.steps // 2 + flight.steps % 2 + 1


def test_a_film_that_is_too_large_becomes_a_poster(falling, monkeypatch):
    monkeypatch.setattr(embedded, "_MOST_BYTES", 1_000)
    assert picture_in(falling._repr_html_()).format == "PNG"


def test_a_flight_without_pictures_is_its_line_of_facts():
    flight = record_flight(Always(1), "CartPole-v1", 3, "right", drawn=False)
    assert "<figcaption>right: CartPole-v1 from start 3" in flight._repr_html_()
