"""One picture of a lander's flight: backdrop, path, lander and dials."""

from collections.abc import Collection
from itertools import groupby
from math import dist, exp

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from touchdown.envs.flight import Flight, Terrain
from touchdown.lander.rules import IDLE, MAIN_ENGINE
from touchdown.render import dashboard
from touchdown.render.backdrop import backdrop
from touchdown.render.canvas import HEIGHT, SUPERSAMPLING, Canvas, Point, bounds, glow
from touchdown.render.sprite import FLAME, lander_tile, nozzle

_TRAIL = (150, 196, 255)
_TRAIL_SECONDS = 0.8  # in which the fresh trail fades to 1/e
_STEADY = round(255 * 0.55)  # shade of a trail that does not fade
_GHOST_SECONDS = 0.5
_GHOST_DISTANCE = 1.25  # metres between ghosts, so that they stay apart


class Scene:
    """Draws a recorded flight of the lander.

    Args:
        flight: a flight of the lander.
        scale: 1 is 600 pixels wide.
        texts: whether to draw the title, the dials and the outcome.
    """

    def __init__(self, flight: Flight, scale: float = 1.0, *, texts: bool = True) -> None:
        bodies, terrain = flight.bodies, flight.terrain
        if bodies is None or terrain is None:
            raise ValueError(f"{flight.env_id}: only the lander's flights are drawn from bodies")
        self.flight = flight
        self.canvas = Canvas(scale)
        self._bodies: NDArray[np.float32] = bodies
        self._terrain: Terrain = terrain
        self._path = [self._hull(step) for step in range(flight.steps + 1)]
        self._pixels = [self.canvas.pixel(x, y) for x, y in self._path]
        ages = (steps / flight.steps_per_second for steps in range(flight.steps + 1))
        self._shades = [round(255 * (0.16 + 0.62 * exp(-age / _TRAIL_SECONDS))) for age in ages]
        """Of a line of the trail that is so many steps old."""
        self._still = backdrop(self.canvas, terrain, flight.seed)
        self._texts = texts
        if texts:
            dashboard.draw_title(self._still, self.canvas, flight)
            dashboard.draw_labels(self._still, self.canvas)

    def frame(self, step: int, since: int | None = None, *, outcome: bool = False) -> Image.Image:
        """The picture after `step` steps.

        Args:
            step: 0 to T.
            since: step of the previous picture, so that engine burns between the two are shown;
                None means the previous step.
            outcome: whether to write the outcome on the picture.
        """
        engines = self._engines(max(step - 1, 0) if since is None else since, step)
        picture = self._still.copy()
        self._draw_trail(picture, step)
        self._draw_lander(picture, step, engines)
        if not self._texts:
            return picture
        dashboard.draw_dials(picture, self.canvas, self.flight, step, engines)
        x, y = self._hull(step)
        if y > HEIGHT + 0.6:
            dashboard.draw_height_marker(picture, self.canvas, x, y)
        if outcome:
            dashboard.draw_outcome(picture, self.canvas, self.flight)
        return picture

    def composite(self) -> Image.Image:
        """The whole flight in one picture: its path, ghosts of the lander, and its end."""
        last = self.flight.steps
        picture = self._still.copy()
        self._draw_trail(picture, last, fading=False)
        for step in self.ghosts():
            opacity = 0.3 + 0.35 * step / last
            self._draw_lander(picture, step, self._engines(max(step - 2, 0), step), opacity)
        engines = self._engines(last - 1, last)
        self._draw_lander(picture, last, engines)
        dashboard.draw_dials(picture, self.canvas, self.flight, last, engines)
        dashboard.draw_verdict(picture, self.canvas, self.flight)
        return picture

    def ghosts(self) -> list[int]:
        """Steps half a second apart, in increasing order, at which ghosts do not overlap."""
        apart = [self.flight.steps]
        stride = max(1, round(_GHOST_SECONDS * self.flight.steps_per_second))
        for step in range(self.flight.steps - stride, -1, -stride):
            if min(dist(self._hull(step), self._hull(other)) for other in apart) > _GHOST_DISTANCE:
                apart.append(step)
        return apart[:0:-1]

    def _hull(self, step: int) -> Point:
        return float(self._bodies[step, 0, 0]), float(self._bodies[step, 0, 1])

    def _engines(self, since: int, step: int) -> set[int]:
        return set(self.flight.actions[since:step].tolist()) - {IDLE}

    def _draw_lander(
        self, picture: Image.Image, step: int, engines: Collection[int], opacity: float = 1.0
    ) -> None:
        bodies = self._bodies[step]
        if MAIN_ENGINE in engines:
            centre = self.canvas.pixel(*nozzle(bodies))
            glow(picture, centre, self.canvas.pixels(52), FLAME[0], 0.5 * opacity)
        x, y = self._hull(step)
        clearance = y - float(np.interp(x, self._terrain.xs, self._terrain.heights))
        tile = lander_tile(self.canvas, bodies, engines, flicker=step, clearance=clearance)
        tile.paste(picture, opacity)

    def _draw_trail(self, picture: Image.Image, step: int, *, fading: bool = True) -> None:
        if step == 0:
            return
        (left, bottom), (right, top) = bounds(self._path[: step + 1], 0.2)
        corner = self.canvas.pixel(left, top)
        origin = int(corner[0]), int(corner[1])
        end = self.canvas.pixel(right, bottom)
        size = int(end[0]) - origin[0] + 1, int(end[1]) - origin[1] + 1
        mask = Image.new("L", (size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING))
        draw = ImageDraw.Draw(mask)
        places = [
            ((column - origin[0]) * SUPERSAMPLING, (row - origin[1]) * SUPERSAMPLING)
            for column, row in self._pixels[: step + 1]
        ]
        width = round(self.canvas.pixels(1.6) * SUPERSAMPLING)
        shades = self._shades[step:0:-1] if fading else [_STEADY] * step
        first = 0
        # lines of one shade are drawn in one call: all but the latest few
        for shade, lines in groupby(shades):
            last = first + len(list(lines))
            draw.line(places[first : last + 1], shade, width)
            first = last
        picture.paste(_TRAIL, origin, mask.reduce(SUPERSAMPLING))
