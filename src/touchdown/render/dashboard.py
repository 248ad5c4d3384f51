"""Text and dials over the picture of a flight."""

from collections.abc import Collection

from PIL import Image, ImageDraw

from touchdown.core.terminal import printable_line
from touchdown.core.types import Outcome
from touchdown.envs.flight import Flight
from touchdown.lander import stock
from touchdown.lander.rules import LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE, fuel_of
from touchdown.render.canvas import HEIGHT, WIDTH, Canvas, font
from touchdown.render.sprite import FLAME, PUFF

OUTCOME_COLOURS: dict[Outcome, tuple[int, int, int]] = {
    "landed": (94, 222, 160),
    "crashed": (255, 112, 82),
    "out of bounds": (255, 190, 72),
    "timed out": (140, 190, 245),
    "terminated": (214, 220, 232),
}
_BRIGHT, _MUTED, _DARK = (240, 243, 250), (150, 156, 174), (62, 65, 78)
_NIGHT = (9, 12, 28)
_DIALS = (22, 92, 172, 246, 336, 426, 506)  # left edges on the 600-pixel picture
_LAMPS = (
    # triangles around the centre of the lamp that point in the direction of thrust
    (LEFT_ENGINE, -20, ((5, -5), (5, 5), (-5, 0)), PUFF[1]),
    (MAIN_ENGINE, 0, ((-6, 4), (6, 4), (0, -6)), FLAME[1]),
    (RIGHT_ENGINE, 20, ((-5, -5), (-5, 5), (5, 0)), PUFF[1]),
)


def draw_title(picture: Image.Image, canvas: Canvas, flight: Flight) -> None:
    """The policy's name and the start, in the upper left corner."""
    draw = ImageDraw.Draw(picture)
    name = printable_line(flight.policy)
    draw.text(_at(canvas, 16, 13), name, _BRIGHT, font(canvas.pixels(15), bold=True))
    draw.text(_at(canvas, 16, 33), f"start {flight.seed}", _MUTED, font(canvas.pixels(11)))


def draw_labels(picture: Image.Image, canvas: Canvas) -> None:
    """The names of the dials, which are the same on every picture."""
    draw = ImageDraw.Draw(picture)
    names = ("time", "return", "fuel spent", "vx", "vy", "angle", "engines")
    for left, name in zip(_DIALS, names, strict=True):
        draw.text(_at(canvas, left, 408), name, _MUTED, font(canvas.pixels(10)))


def draw_dials(
    picture: Image.Image, canvas: Canvas, flight: Flight, step: int, engines: Collection[int]
) -> None:
    """The values of the dials after `step` steps, and which engines are firing."""
    vx, vy = velocity(flight, step)
    degrees = float(flight.observations[step, 4]) * 57.29578
    values = (
        f"{step / flight.steps_per_second:.2f} s",
        _signed(float(flight.returns[step]), 1),
        f"{fuel_of(flight.actions[:step]):.1f}",
        f"{_signed(vx, 2)} m/s",
        f"{_signed(vy, 2)} m/s",
        f"{_signed(degrees, 0)}°",
    )
    draw = ImageDraw.Draw(picture)
    for left, value in zip(_DIALS, values, strict=False):
        draw.text(_at(canvas, left, 422), value, _BRIGHT, font(canvas.pixels(13), bold=True))
    for engine, offset, outline, colour in _LAMPS:
        points = [_at(canvas, _DIALS[-1] + 26 + offset + x, 430 + y) for x, y in outline]
        draw.polygon(points, colour if engine in engines else _DARK)


def velocity(flight: Flight, step: int) -> tuple[float, float]:
    """The lander's velocity in m/s, from the scaled units of its observation."""
    _, _, vx, vy = flight.observations[step, :4].tolist()
    return (
        vx * stock.FPS / (WIDTH / 2),
        vy * stock.FPS / (HEIGHT / 2),
    )


def draw_outcome(picture: Image.Image, canvas: Canvas, flight: Flight) -> None:
    """The outcome and the episode return, in large letters."""
    draw = ImageDraw.Draw(picture)
    for text, y, size, colour in (
        (flight.outcome.upper(), 128, 42, OUTCOME_COLOURS[flight.outcome]),
        (f"return {_signed(flight.episode_return, 1)}", 166, 18, _BRIGHT),
    ):
        draw.text(
            _at(canvas, 300, y),
            text,
            colour,
            font(canvas.pixels(size), bold=True),
            anchor="mm",
            stroke_width=round(canvas.pixels(2)),  # a lander may be behind it
            stroke_fill=_NIGHT,
        )


def draw_verdict(picture: Image.Image, canvas: Canvas, flight: Flight) -> None:
    """The outcome and the episode return, below the title, where no path is."""
    draw = ImageDraw.Draw(picture)
    text, colour = flight.outcome.capitalize(), OUTCOME_COLOURS[flight.outcome]
    draw.text(_at(canvas, 16, 57), text, colour, font(canvas.pixels(24), bold=True))
    below = f"return {_signed(flight.episode_return, 1)}"
    draw.text(_at(canvas, 16, 88), below, _BRIGHT, font(canvas.pixels(13), bold=True))


def draw_height_marker(picture: Image.Image, canvas: Canvas, x: float, y: float) -> None:
    """Mark a lander above the picture: its x, and its distance above the edge in metres."""
    column = min(max(canvas.pixel(x, 0)[0], canvas.pixels(40)), canvas.pixels(560))
    top = canvas.pixels(6)
    half, tall = canvas.pixels(6), canvas.pixels(8)
    draw = ImageDraw.Draw(picture)
    draw.polygon([(column, top), (column - half, top + tall), (column + half, top + tall)], _BRIGHT)
    text = f"{y - HEIGHT:.1f} m"
    small = font(canvas.pixels(10))
    draw.text((column, top + canvas.pixels(16)), text, _BRIGHT, small, anchor="mm")


def _at(canvas: Canvas, x: float, y: float) -> tuple[float, float]:
    """Scale a position on the 600-pixel picture to pixels of this one."""
    return canvas.pixels(x), canvas.pixels(y)


def _signed(value: float, digits: int) -> str:
    text = f"{value:+.{digits}f}".replace("-", "−")
    return text if text.strip("+−0.") else text[1:]  # a zero has no sign
