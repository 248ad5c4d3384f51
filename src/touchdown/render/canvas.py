"""Draws in metres on a picture in pixels, with antialiasing."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from math import ceil, floor
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from touchdown.lander import stock

WIDTH = stock.VIEWPORT_W / stock.SCALE  # metres that the picture shows
HEIGHT = stock.VIEWPORT_H / stock.SCALE
DASHBOARD = 50 / stock.SCALE  # metres of ground below y = 0, where the dials are
SUPERSAMPLING = 4  # pixels drawn per pixel of the picture along each axis, then averaged

Colour = tuple[int, int, int]
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Canvas:
    """The scale of the picture; the origin, (0, 0) m, lies above its bottom by the dashboard."""

    scale: float = 1.0
    """1 is Gymnasium's viewport, 30 pixels per metre."""

    @property
    def pixels_per_metre(self) -> float:
        """Pixels per metre."""
        return stock.SCALE * self.scale

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, both even as videos need them."""
        width, height = WIDTH * self.pixels_per_metre, (HEIGHT + DASHBOARD) * self.pixels_per_metre
        return 2 * round(width / 2), 2 * round(height / 2)

    def pixel(self, x: float, y: float) -> Point:
        """Column and row of a point in metres; rows count downwards."""
        return x * self.pixels_per_metre, (HEIGHT - y) * self.pixels_per_metre

    def pixels(self, length: float) -> float:
        """Scale a length on the 600-pixel picture, such as a line width, to this one."""
        return length * self.scale


class Tile:
    """A transparent piece of the picture, drawn larger and then shrunk.

    Args:
        canvas: the scale of the picture.
        corners: lower left and upper right in metres.
    """

    def __init__(self, canvas: Canvas, corners: tuple[Point, Point]) -> None:
        (left, bottom), (right, top) = canvas.pixel(*corners[0]), canvas.pixel(*corners[1])
        self._canvas = canvas
        self._origin = floor(left), floor(top)
        size = ceil(right) - self._origin[0], ceil(bottom) - self._origin[1]
        width, height = (max(side, 1) * SUPERSAMPLING for side in size)
        # premultiplied alpha, as averaging needs; all colours are opaque, so none are converted
        self._image = Image.new("RGBa", (width, height))
        self._draw = ImageDraw.Draw(self._image)

    def polygon(self, points: Iterable[Point], colour: Colour) -> None:
        """Fill a polygon with corners in metres."""
        self._draw.polygon([self._place(point) for point in points], (*colour, 255))

    def line(self, points: Iterable[Point], colour: Colour, width: float) -> None:
        """Draw a line through points in metres; `width` is in pixels of the 600-pixel picture."""
        pixels = self._canvas.pixels(width) * SUPERSAMPLING
        places = [self._place(point) for point in points]
        self._draw.line(places, (*colour, 255), round(pixels), "curve")

    def paste(self, picture: Image.Image, opacity: float = 1.0) -> None:
        """Paste the tile over the picture at its place."""
        small = self._image.reduce(SUPERSAMPLING).convert("RGBA")
        mask = small.getchannel("A")
        if opacity < 1:
            mask = mask.point([round(alpha * opacity) for alpha in range(256)])
        picture.paste(small.convert("RGB"), self._origin, mask)

    def _place(self, point: Point) -> Point:
        column, row = self._canvas.pixel(*point)
        return (
            (column - self._origin[0]) * SUPERSAMPLING,
            (row - self._origin[1]) * SUPERSAMPLING,
        )


def glow(
    picture: Image.Image, centre: Point, radius: float, colour: Colour, opacity: float
) -> None:
    """A soft round light; centre and radius in pixels."""
    side = 2 * ceil(radius)
    mask = _glow(side).point([round(alpha * opacity) for alpha in range(256)])
    picture.paste(colour, (round(centre[0] - side / 2), round(centre[1] - side / 2)), mask)


@cache
def _glow(side: int) -> Image.Image:
    rim = 255 / 2**0.5  # the gradient reaches 255 in the corners
    fall = [round(255 * max(0.0, 1 - distance / rim) ** 2) for distance in range(256)]
    return Image.radial_gradient("L").point(fall).resize((side, side))


def bounds(points: Sequence[Point], margin: float) -> tuple[Point, Point]:
    """The corners of a box around points with a margin, clipped to the picture, in metres."""
    xs = [min(max(x, 0.0), WIDTH) for x, _ in points]
    ys = [min(max(y, -DASHBOARD), HEIGHT) for _, y in points]
    return (min(xs) - margin, min(ys) - margin), (max(xs) + margin, max(ys) + margin)


@cache
def font(size: float, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """DejaVu Sans, which comes with matplotlib, at a size in pixels."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    import matplotlib as mpl  # noqa: PLC0415 - only pictures need it

    return ImageFont.truetype(Path(mpl.get_data_path(), "fonts", "ttf", name), size)
