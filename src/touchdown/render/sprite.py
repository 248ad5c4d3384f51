"""Draws the lander: hull, legs and the flames of its engines."""

from collections.abc import Collection, Sequence
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchdown.lander import stock
from touchdown.lander.rules import LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE
from touchdown.render.canvas import Canvas, Colour, Point, Tile

_REACH, _MAIN_REACH = 1.5, 2.1  # metres from the hull's centre to the ends of legs and flames

# outlines in the frame of the body, in Gymnasium's units (SCALE per metre);
# hull and leg are the bodies that collide; the rest is decoration inside or close to them
_HULL: list[Point] = [(float(x), float(y)) for x, y in stock.LANDER_POLY]
_LEG_W, _LEG_H = stock.LEG_W, stock.LEG_H
_LEG: list[Point] = [(-_LEG_W, -_LEG_H), (_LEG_W, -_LEG_H), (_LEG_W, _LEG_H), (-_LEG_W, _LEG_H)]
_CABIN_SHADE: list[Point] = [(5, 17), (14, 17), (17, 0), (5, 0)]
_CABIN_RIM: list[Point] = [(-14, 17), (14, 17), (14.3, 15.2), (-14.3, 15.2)]
_SKIRT: list[Point] = [(-17, 0), (17, 0), (17, -10), (-17, -10)]
_SKIRT_SHADE: list[Point] = [(5, 0), (17, 0), (17, -10), (5, -10)]
_WINDOW: list[Point] = [(-10, 13), (1.5, 13), (2.5, 4.5), (-11, 4.5)]
_GLINT: list[Point] = [(-9.4, 12.3), (-5.2, 12.3), (-7.6, 5.4), (-10.2, 5.4)]
_NOZZLE: list[Point] = [(-4, -10), (4, -10), (6, -14.5), (-6, -14.5)]

_HULL_COLOUR, _HULL_SHADE, _HULL_RIM = (222, 227, 238), (172, 180, 200), (250, 251, 255)
_SKIRT_COLOUR, _SKIRT_DARK = (226, 168, 62), (184, 128, 38)
_WINDOW_COLOUR, _GLINT_COLOUR = (24, 42, 78), (104, 158, 214)
_METAL, _STRUT, _LEG_COLOUR = (92, 98, 116), (150, 157, 176), (196, 202, 217)

FLAME = ((255, 112, 28), (255, 190, 58), (255, 250, 226))  # from the outside inwards
PUFF = ((112, 172, 255), (196, 224, 255), (250, 253, 255))
_MAIN_LENGTH, _SIDE_LENGTH = 46, 24
_LAYERS = ((1.0, 1.0), (0.72, 0.66), (0.46, 0.36))  # length and width of a flame's layers

Body = tuple[float, float, float]  # x, y in metres, angle in radians


class _Plume(NamedTuple):
    """A flame in the hull's frame and Gymnasium's units."""

    root: Point
    direction: Point
    length: float
    width: float
    colours: tuple[Colour, ...]


def lander_tile(
    canvas: Canvas,
    bodies: NDArray[np.float32],
    engines: Collection[int],
    *,
    flicker: int,
    clearance: float,
) -> Tile:
    """The lander and its flames.

    Args:
        canvas: the scale of the picture.
        bodies: [3, 3]: hull, leg, leg, each x, y in metres and angle in radians.
        engines: actions whose engines are firing.
        flicker: step number, which varies the length of the flames.
        clearance: metres from the centre of the hull to the ground, where the main flame ends.
    """
    hull, *legs = ((float(x), float(y), float(angle)) for x, y, angle in bodies)
    x, y, _ = hull
    reach = _MAIN_REACH if MAIN_ENGINE in engines else _REACH
    tile = Tile(canvas, ((x - reach, y - reach), (x + reach, y + reach)))
    flaring = 0.86 + 0.14 * sin(2.4 * flicker) * cos(0.9 * flicker)
    main, side = _MAIN_LENGTH * flaring, _SIDE_LENGTH * flaring
    main = min(main, max(clearance * stock.SCALE - 12, 8))
    # an engine is named after its direction of thrust: the flame of the left one points right
    plumes = {
        MAIN_ENGINE: _Plume((0, -13), (0, -1), main, 5.6, FLAME),
        LEFT_ENGINE: _Plume((15, 14), (1, 0), side, 3.4, PUFF),
        RIGHT_ENGINE: _Plume((-15, 14), (-1, 0), side, 3.4, PUFF),
    }
    for engine in engines:
        _draw_plume(tile, hull, plumes[engine])
    for leg in legs:
        side = 1 if _to_body(hull, leg[:2])[0] > 0 else -1
        struts = _to_scene(hull, [(15 * side, -1), (12 * side, -9)])
        for strut in struts:
            tile.line([strut, leg[:2]], _STRUT, 1.3)
        tile.polygon(_to_scene(leg, _LEG), _LEG_COLOUR)
    tile.polygon(_to_scene(hull, _NOZZLE), _METAL)
    for outline, colour in (
        (_HULL, _HULL_COLOUR),
        (_CABIN_SHADE, _HULL_SHADE),
        (_CABIN_RIM, _HULL_RIM),
        (_SKIRT, _SKIRT_COLOUR),
        (_SKIRT_SHADE, _SKIRT_DARK),
        (_WINDOW, _WINDOW_COLOUR),
        (_GLINT, _GLINT_COLOUR),
    ):
        tile.polygon(_to_scene(hull, outline), colour)
    return tile


def nozzle(bodies: NDArray[np.float32]) -> Point:
    """Start of the main engine's flame in metres; `bodies` as in `lander_tile`."""
    x, y, angle = (float(value) for value in bodies[0])
    return _to_scene((x, y, angle), [(0, -22)])[0]


def _draw_plume(tile: Tile, hull: Body, plume: _Plume) -> None:
    along = np.linspace(0, 1, 12)
    half_widths = (0.62 + 1.5 * along) * (1 - along) ** 0.75 * (1 - 0.25 * along)
    for (longer, wider), colour in zip(_LAYERS, plume.colours, strict=True):
        ahead = along * plume.length * longer
        aside = half_widths * plume.width * wider
        # out along one edge and back along the other
        ahead, aside = np.append(ahead, ahead[::-1]), np.append(aside, -aside[::-1])
        xs = plume.root[0] + plume.direction[0] * ahead - plume.direction[1] * aside
        ys = plume.root[1] + plume.direction[1] * ahead + plume.direction[0] * aside
        tile.polygon(_to_scene(hull, list(zip(xs.tolist(), ys.tolist(), strict=True))), colour)


def _to_scene(body: Body, points: Sequence[Point]) -> list[Point]:
    """Points in a body's frame, in Gymnasium's units, to the scene's frame, in metres."""
    x, y, angle = body
    c, s = cos(angle) / stock.SCALE, sin(angle) / stock.SCALE
    return [(x + c * px - s * py, y + s * px + c * py) for px, py in points]


def _to_body(body: Body, point: Point) -> Point:
    """A point in the scene's frame to a body's frame, both in metres."""
    x, y, angle = body
    dx, dy = point[0] - x, point[1] - y
    return cos(angle) * dx + sin(angle) * dy, cos(angle) * dy - sin(angle) * dx
