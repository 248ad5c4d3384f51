"""A film of learning: policies from different times of a training fly one start, side by side."""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from math import ceil, sqrt
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from touchdown.core.terminal import printable_line
from touchdown.envs.flight import Flight
from touchdown.render import encode
from touchdown.render.canvas import DASHBOARD, font
from touchdown.render.dashboard import OUTCOME_COLOURS
from touchdown.render.encode import Picture
from touchdown.render.film import HOLD_SECONDS, check_video_path
from touchdown.render.scene import Scene

MOST_PANELS = 9
"""Flights side by side; more would be too small to see."""
_SCALE = 0.5  # of a panel, 300 pixels wide
_SPEED = 2  # times as fast as real time
_FPS = {".gif": 12.5, ".mp4": 25.0}
_SAMPLES = 8  # pictures of a GIF that its palette is based on
_CAPTION, _GAP = 26, 2  # pixels
_BEHIND, _BRIGHT = (9, 12, 28), (240, 243, 250)


def write_learning(flights: Sequence[Flight], path: Path) -> None:
    """Write a film of policies that fly one start at the same time, the earliest first.

    Args:
        flights: of the lander, from one start, at most `MOST_PANELS`; each has the policy's name.
        path: ends in .gif or .mp4.

    Raises:
        UserError: another suffix, or the file cannot be written.
        ValueError: the number of flights is out of range.
    """
    check_video_path(path)
    if not 1 <= len(flights) <= MOST_PANELS:
        raise ValueError(f"flights: {len(flights)}, must be from 1 to {MOST_PANELS}")
    last = max(flight.steps for flight in flights)
    fps = _FPS[path.suffix.lower()]
    stride = round(_SPEED * flights[0].steps_per_second / fps)
    panels = [_Panel(flight, stride) for flight in flights]
    film = _pictures(panels, [*range(0, last, stride), last], 1 / fps)
    if path.suffix.lower() == ".gif":
        steps = np.linspace(0, last, _SAMPLES).astype(int).tolist()
        encode.write_gif(film, [_grid(panels, step) for step in steps], path)
    else:
        encode.write_mp4(film, Fraction(fps), path)


class _Panel:
    """One flight of the film, with the policy's name over it.

    Args:
        flight: the flight.
        stride: steps from one picture of the film to the next.
    """

    def __init__(self, flight: Flight, stride: int) -> None:
        self._flight = flight
        self._stride = stride
        self._scene = Scene(flight, _SCALE, texts=False)
        self._end: Image.Image | None = None
        width, height = self._scene.canvas.size
        self._hidden = round(self._scene.canvas.pixels_per_metre * DASHBOARD * 0.7)
        self.size = width, height - self._hidden + _CAPTION

    def picture(self, step: int) -> Image.Image:
        """The panel after `step` steps, or at the end of a shorter flight, which stays."""
        if step < self._flight.steps:
            return self._drawn(step)
        if self._end is None:
            self._end = self._drawn(self._flight.steps)
        return self._end

    def _drawn(self, step: int) -> Image.Image:
        flight = self._flight
        panel = Image.new("RGB", self.size, _BEHIND)
        since = max(0, step - 1) // self._stride * self._stride  # of the previous picture
        panel.paste(self._scene.frame(step, since), (0, _CAPTION))
        draw = ImageDraw.Draw(panel)
        middle = _CAPTION / 2
        draw.text((8, middle), printable_line(flight.policy), _BRIGHT, font(13, bold=True), "lm")
        if step == flight.steps:
            said = f"{flight.outcome} {flight.episode_return:+.0f}".replace("-", "−")
            colour = OUTCOME_COLOURS[flight.outcome]
            place = (self.size[0] - 8, middle)
            draw.text(place, said, colour, font(13, bold=True), "rm")
        return panel


def _pictures(panels: Sequence[_Panel], steps: Sequence[int], seconds: float) -> Iterator[Picture]:
    for step in steps:
        yield Picture(_grid(panels, step), HOLD_SECONDS * 2 if step == steps[-1] else seconds)


def _grid(panels: Sequence[_Panel], step: int) -> Image.Image:
    columns = ceil(sqrt(len(panels)))
    rows = ceil(len(panels) / columns)
    width, height = (side + _GAP for side in panels[0].size)
    size = (columns * width - _GAP, rows * height - _GAP)
    # H.264 needs even sides
    picture = Image.new("RGB", (size[0] + size[0] % 2, size[1] + size[1] % 2), _BEHIND)
    for place, panel in enumerate(panels):
        row, column = divmod(place, columns)
        picture.paste(panel.picture(step), (column * width, row * height))
    return picture
