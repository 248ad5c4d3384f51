"""The fixed part of a flight's picture: sky, moon and landing pad."""

from typing import NamedTuple

import numpy as np
from PIL import Image

from touchdown.core.types import FloatArray
from touchdown.envs.flight import Terrain
from touchdown.render.canvas import HEIGHT, WIDTH, Canvas, Tile

_SKY = np.array([[4, 6, 15], [9, 13, 31], [20, 26, 56], [40, 42, 78]], np.float64)  # top to horizon
_GROUND_LIT, _GROUND_DEEP = np.array([150, 152, 164.0]), np.array([23, 24, 33.0])
_GROUND_DEPTH = 1.5  # metres in which the light falls to 1/e
_SUN = np.array([-0.55, 0.835])  # towards the light
_STARS = 110
_CRATERS, _FLATTENED = 16, 0.42  # seen from the side
_EARTH = (16.9, 11.5, 0.72)  # x, y, radius in metres
_SLAB = 0.1  # thickness of the pad in metres
_FLAG_HEIGHT = 50 / 30  # metres, as in Gymnasium's picture
_PAD_COLOUR, _PAD_SHADE, _POLE = (236, 239, 247), (128, 132, 150), (205, 209, 222)
_FLAG, _FLAG_SHADE = (255, 196, 61), (222, 150, 30)


_Part = tuple[slice, slice]  # rows and columns


class _Grid(NamedTuple):
    """The centres of the picture's pixels, in metres."""

    xs: FloatArray  # [columns]
    ys: FloatArray  # [rows], downwards

    def around(self, x: float, y: float, half_width: float, half_height: float) -> _Part:
        """The pixels in a box."""
        columns = np.flatnonzero(np.abs(self.xs - x) <= half_width)
        rows = np.flatnonzero(np.abs(self.ys - y) <= half_height)
        if not (len(columns) and len(rows)):
            return slice(0), slice(0)
        return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def backdrop(canvas: Canvas, terrain: Terrain, seed: int) -> Image.Image:
    """Sky, moon and pad of one start; the same start always looks the same."""
    rng = np.random.default_rng(seed)
    columns, rows = canvas.size
    grid = _Grid(
        (np.arange(columns) + 0.5) / canvas.pixels_per_metre,
        HEIGHT - (np.arange(rows) + 0.5) / canvas.pixels_per_metre,
    )
    pixels = _sky(grid)
    _add_stars(pixels, canvas, rng)
    _add_earth(pixels, canvas, grid)
    _add_moon(pixels, canvas, grid, terrain, rng)
    picture = Image.fromarray(np.clip(pixels, 0, 255).round().astype(np.uint8))
    _draw_pad(picture, canvas, terrain)
    return picture


def _sky(grid: _Grid) -> FloatArray:
    """[rows, columns, 3], 0 to 255."""
    depth = np.clip(1 - grid.ys / HEIGHT, 0, 1)
    stops = np.linspace(0, 1, len(_SKY))
    gradient = np.stack([np.interp(depth, stops, _SKY[:, band]) for band in range(3)], axis=-1)
    return np.repeat(gradient[:, None], len(grid.xs), axis=1)


def _add_stars(pixels: FloatArray, canvas: Canvas, rng: np.random.Generator) -> None:
    columns, rows = canvas.size
    tints = np.array([[255, 255, 255], [202, 218, 255], [255, 232, 205]])
    for _ in range(_STARS):
        x, y = rng.uniform(0, columns), rng.uniform(0, HEIGHT * canvas.pixels_per_metre)
        brightness = 0.12 + 0.75 * rng.power(0.35)
        radius = canvas.pixels(0.42 + 0.38 * brightness)
        tint = tints[rng.integers(len(tints))]
        reach = int(3 * radius) + 1
        top, left = max(int(y) - reach, 0), max(int(x) - reach, 0)
        bottom, right = min(int(y) + reach + 1, rows), min(int(x) + reach + 1, columns)
        down = np.arange(top, bottom)[:, None] + 0.5 - y
        across = np.arange(left, right) + 0.5 - x
        light = brightness * np.exp(-(down**2 + across**2) / (2 * radius**2))[..., None]
        patch = pixels[top:bottom, left:right]
        patch += (tint - patch) * light


def _add_earth(pixels: FloatArray, canvas: Canvas, grid: _Grid) -> None:
    x, y, radius = _EARTH
    rows, columns = grid.around(x, y, 2 * radius, 2 * radius)
    pixels = pixels[rows, columns]
    across, up = (grid.xs[columns] - x) / radius, ((grid.ys[rows] - y) / radius)[:, None]
    distance = np.hypot(across, up)
    edge = radius * canvas.pixels_per_metre
    cover = np.clip((1 - distance) * edge + 0.5, 0, 1)[..., None]
    bulge = np.sqrt(np.clip(1 - distance**2, 0, 1))
    light = np.clip(0.12 + 1.1 * (-0.62 * across + 0.5 * up + 0.55 * bulge), 0.06, 1)[..., None]
    swirl = np.sin(7.5 * up + 1.6 * np.sin(3.1 * across + 1.0) + 2.0) + 0.6 * np.sin(
        5 * across - up
    )
    clouds = np.clip(0.8 * swirl - 0.35, 0, 0.6)[..., None]
    sea, cloud = np.array([52, 112, 186.0]), np.array([226, 236, 246.0])
    pixels += (((sea + (cloud - sea) * clouds) * light) - pixels) * cover
    halo = np.clip(2 - distance, 0, 1)[..., None] ** 4 * (1 - cover)
    pixels += np.array([26, 44, 74.0]) * 0.55 * halo


def _add_moon(
    pixels: FloatArray,
    canvas: Canvas,
    grid: _Grid,
    terrain: Terrain,
    rng: np.random.Generator,
) -> None:
    surface = np.interp(grid.xs, terrain.xs, terrain.heights)
    slope = np.gradient(surface, grid.xs)
    facing = np.stack((-slope, np.ones_like(slope))) / np.hypot(slope, 1)
    lit = np.clip(_SUN @ facing, 0, 1)
    depth = surface - grid.ys[:, None]  # metres below the surface, negative in the sky
    # measured across the slope, so that a steep edge is as smooth as a flat one
    across = depth / np.hypot(slope, 1) * canvas.pixels_per_metre
    cover = np.clip(across + 0.5, 0, 1)[..., None]
    # light fades below a smoothed surface, or every corner would cast a column of light
    below = _blurred(surface, 1.6 * canvas.pixels_per_metre) - grid.ys[:, None]
    fall = np.exp(-np.clip(below, 0, None) / _GROUND_DEPTH)[..., None]
    light = 0.5 + 0.3 * _blurred(lit, 1.6 * canvas.pixels_per_metre)
    fall *= np.clip((grid.ys + 0.2) / 0.8, 0, 1)[:, None, None]  # the dials need a dark background
    ground = _GROUND_DEEP + (_GROUND_LIT - _GROUND_DEEP) * fall * light[:, None]
    ground *= _craters(grid, terrain, rng)[..., None]
    rim = np.exp(-np.clip(across, 0, None) / canvas.pixels(1.3)) * (0.25 + 0.5 * lit)
    ground += (np.array([226, 228, 238.0]) - ground) * rim[..., None]
    pixels += (ground - pixels) * cover


def _blurred(values: FloatArray, width: float) -> FloatArray:
    """Mean over a window of about `width` places of a row of values, [columns]."""
    reach = round(width / 2)
    window = np.full(2 * reach + 1, 1 / (2 * reach + 1))
    return np.convolve(np.pad(values, reach, "edge"), window, "valid")


def _craters(grid: _Grid, terrain: Terrain, rng: np.random.Generator) -> FloatArray:
    """Factors on the ground's brightness, [rows, columns]."""
    factors = np.ones((len(grid.ys), len(grid.xs)))
    for _ in range(_CRATERS):
        x, below = rng.uniform(0, WIDTH), 0.35 + 2.6 * rng.beta(1.1, 2.0)
        radius = rng.uniform(0.14, 0.34) * (1 + 0.35 * below)
        y = float(np.interp(x, terrain.xs, terrain.heights)) - below
        if y - radius < 0:  # where the dials are
            continue
        rows, columns = grid.around(x, y, 1.4 * radius, 1.4 * _FLATTENED * radius)
        across = (grid.xs[columns] - x) / radius
        up = (grid.ys[rows, None] - y) / (_FLATTENED * radius)
        distance = np.hypot(across, up)
        away = _SUN[0] * -across - _SUN[1] * up  # from the sun, in radii
        inside = np.clip((1 - distance) * 5, 0, 1)
        wall = np.exp(-(((distance - 1) / 0.14) ** 2))
        # a crater's wall towards the sun is in shadow, the opposite one is lit
        shade = inside * (0.16 * away - 0.2) + wall * 0.3 * np.clip(away, 0, 1)
        factors[rows, columns] *= 1 + shade * np.exp(-below / 2.4)
    return factors


def _draw_pad(picture: Image.Image, canvas: Canvas, terrain: Terrain) -> None:
    left, right = terrain.helipad_x1, terrain.helipad_x2
    ground = float(np.interp((left + right) / 2, terrain.xs, terrain.heights))
    mast = terrain.helipad_y + _FLAG_HEIGHT
    tile = Tile(canvas, ((left - 1.2, ground - 0.6), (right + 1.2, mast + 0.2)))
    tile.polygon(_box(left, ground - _SLAB, right, ground), _PAD_COLOUR)
    tile.polygon(_box(left, ground - 1.8 * _SLAB, right, ground - _SLAB), _PAD_SHADE)
    for x, outwards in ((left, -1), (right, 1)):
        tile.line([(x, ground), (x, mast)], _POLE, 1.4)
        tip = x + outwards * 25 / 30, mast - 1 / 6
        tile.polygon([(x, mast), tip, (x, mast - 1 / 3)], _FLAG)
        tile.polygon([(x, mast - 1 / 6), tip, (x, mast - 1 / 3)], _FLAG_SHADE)
    tile.paste(picture)


def _box(left: float, bottom: float, right: float, top: float) -> list[tuple[float, float]]:
    return [(left, bottom), (right, bottom), (right, top), (left, top)]
