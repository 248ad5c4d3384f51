"""One picture of a lander in flight, without the path and the dials of a film."""

from collections.abc import Collection
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from touchdown.core.types import FloatArray
from touchdown.envs.flight import Terrain
from touchdown.lander import stock
from touchdown.lander.rules import MAIN_ENGINE
from touchdown.render.backdrop import backdrop
from touchdown.render.canvas import HEIGHT, Canvas, glow
from touchdown.render.dashboard import draw_height_marker
from touchdown.render.sprite import FLAME, lander_tile, nozzle

_CANVAS = Canvas()
_STARS = 0  # seed of the sky, which a picture does not depend on


def picture(
    bodies: NDArray[np.float32],
    corners: FloatArray,
    helipad: tuple[float, float, float],
    engines: Collection[int],
    step: int,
) -> NDArray[np.uint8]:
    """A lander over its ground, RGB, [400, 600, 3], as large as stock's.

    Args:
        bodies: hull, leg, leg, each x, y in metres and angle in radians, [3, 3].
        corners: of the ground from left to right, metres, [11, 2].
        helipad: x of the left flag, x of the right flag, and height of the pad, metres.
        engines: actions whose engines are firing.
        step: number of the picture, by which the flames flicker.
    """
    xs, heights = corners[:, 0], corners[:, 1]
    image = _still(tuple(xs.tolist()), tuple(heights.tolist()), helipad).copy()
    x, y = float(bodies[0, 0]), float(bodies[0, 1])
    if MAIN_ENGINE in engines:
        glow(image, _CANVAS.pixel(*nozzle(bodies)), _CANVAS.pixels(52), FLAME[0], 0.5)
    clearance = y - float(np.interp(x, xs, heights))
    tile = lander_tile(_CANVAS, bodies, engines, flicker=step, clearance=clearance)
    tile.paste(image, 1.0)
    if y > HEIGHT + 0.6:
        draw_height_marker(image, _CANVAS, x, y)
    return np.asarray(image)[: stock.VIEWPORT_H].copy()


@lru_cache(maxsize=64)  # a start's sky and ground take twenty times as long as its lander
def _still(
    xs: tuple[float, ...], heights: tuple[float, ...], helipad: tuple[float, float, float]
) -> Image.Image:
    return backdrop(_CANVAS, Terrain(np.array(xs), np.array(heights), *helipad), _STARS)
