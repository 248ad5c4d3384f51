"""A flight's film in a notebook; importing this module makes every `Flight` show it."""

import io
import tempfile
from pathlib import Path
from weakref import WeakKeyDictionary

from touchdown.core import notebook
from touchdown.envs.flight import Flight
from touchdown.render import film

_SCALE = 2 / 3  # 400 pixels wide
_MOST_FPS = 25.0
_MOST_PICTURES = 250  # pictures per film, so that a long flight takes no longer to draw
_MOST_BYTES = 4_000_000  # per film; a larger one would make a notebook slow to open

_made: WeakKeyDictionary[Flight, str] = WeakKeyDictionary()


@notebook.html_of.register
def film_html(flight: Flight) -> str:
    """A flight as a looping film above one line of facts.

    The film is made when it is first shown, and kept as long as the flight.

    Args:
        flight: the flight; if its film is too large, its last picture is shown instead, and if it
            was recorded without pictures, none.
    """
    if flight.frames is None and flight.bodies is None:
        return notebook.figure_html("", flight.facts)
    if flight not in _made:
        _made[flight] = notebook.figure_html(_picture(flight), flight.facts)
    return _made[flight]


def _picture(flight: Flight) -> str:
    seconds = flight.steps / flight.steps_per_second
    fps = min(_MOST_FPS, _MOST_PICTURES / max(seconds, 1.0))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.gif"
        film.write_gif(flight, path, fps, _SCALE)
        data = path.read_bytes()
    if len(data) <= _MOST_BYTES:
        return notebook.picture_html(data, "gif", f"film of {flight.facts}", width=400)
    poster = io.BytesIO()
    film.poster(flight, _SCALE).save(poster, "PNG")
    return notebook.picture_html(poster.getvalue(), "png", f"end of {flight.facts}", width=400)
