"""A flight as a film, as a poster, or live in a window."""

import io
import os
import sys
import time
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import chain, pairwise
from pathlib import Path

import numpy as np
from PIL import Image

from touchdown.core.errors import UserError
from touchdown.core.types import Policy
from touchdown.envs import environment
from touchdown.envs.flight import Flight
from touchdown.envs.recorder import fly
from touchdown.render import encode
from touchdown.render.encode import Picture
from touchdown.render.scene import Scene

HOLD_SECONDS = 1.2  # the last picture is held, so that the outcome can be read
MOST_SECONDS = 600.0  # of a film: GIF cannot show one picture for longer than 655 s
_SUFFIXES = (".gif", ".mp4")
_GIF_FPS, _MP4_FPS = 25, 50
_MP4_SCALE, _POSTER_SCALE = 1.5, 2.0  # 900 and 1200 pixels wide
_SAMPLES = 12  # pictures of a film that its palette is based on


def check_video_path(path: Path) -> None:
    """Check before the flight that a film can be written there.

    Raises:
        UserError: the suffix is neither .gif nor .mp4, or the folder is missing or not writable.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise UserError(f"{path}: must end in .gif or .mp4")
    if path.is_dir():
        raise UserError(f"{path}: is a folder, must be a file")
    if not path.parent.is_dir():
        raise UserError(f"{path}: cannot be written: there is no folder {str(path.parent)!r}")
    if not os.access(path.parent, os.W_OK):
        raise UserError(f"{path}: cannot be written: folder {str(path.parent)!r} is read-only")


def write_video(flights: Flight | Sequence[Flight], path: Path, *, follow: bool = True) -> None:
    """Write flights, one after the other, as a film in real time.

    A film of more than ten minutes is sped up.

    Args:
        flights: one or several flights of the same environment.
        path: ends in .gif (25 pictures per second) or .mp4 (50).
        follow: False for a file of a run's folder, see `files.write_through`.

    Raises:
        UserError: another suffix, or the file cannot be written.
    """
    check_video_path(path)
    if path.suffix.lower() == ".gif":
        write_gif(flights, path, follow=follow)
    else:
        write_mp4(flights, path, follow=follow)


def write_gif(
    flights: Flight | Sequence[Flight],
    path: Path,
    fps: float = _GIF_FPS,
    scale: float = 1.0,
    *,
    follow: bool = True,
) -> None:
    """Write flights as an animated GIF that loops forever.

    Args:
        flights: one or several flights of the same environment.
        path: the file.
        fps: maximum number of pictures per second; steps in between are skipped.
        scale: 1 is 600 pixels wide; no effect on an environment that draws its own frames.
        follow: False for a file of a run's folder, see `files.write_through`.

    Raises:
        UserError: the file cannot be written.
    """
    shown = _as_sequence(flights)
    speed = _speed(shown)
    samples = [image for flight in shown for image in _samples(flight)]
    film = chain.from_iterable(pictures(flight, fps, scale, speed) for flight in shown)
    encode.write_gif(film, samples, path, follow=follow)


def write_mp4(
    flights: Flight | Sequence[Flight], path: Path, fps: int = _MP4_FPS, *, follow: bool = True
) -> None:
    """Write flights as an H.264 film that every browser plays.

    Args:
        flights: one or several flights of the same environment.
        path: the file.
        fps: maximum number of pictures per second; steps in between are skipped.
        follow: False for a file of a run's folder, see `files.write_through`.

    Raises:
        UserError: the file cannot be written.
    """
    shown = _as_sequence(flights)
    speed = _speed(shown)
    film = chain.from_iterable(pictures(flight, fps, _MP4_SCALE, speed) for flight in shown)
    steps_per_second = Fraction(shown[0].steps_per_second * speed).limit_denominator(1_000)
    rate = steps_per_second / _stride(shown[0], fps, speed)
    encode.write_mp4(film, rate, path, follow=follow)


def pictures(
    flight: Flight, fps: float = _GIF_FPS, scale: float = 1.0, speed: float = 1.0
) -> Iterator[Picture]:
    """The pictures of a film of one flight; the last one is held.

    Args:
        flight: the flight to show.
        fps: maximum number of pictures per second.
        scale: 1 is 600 pixels wide; no effect on an environment that draws its own frames.
        speed: 1 is real time.
    """
    stride = _stride(flight, fps, speed)
    steps = [*range(0, flight.steps, stride), flight.steps]
    for image, step in zip(_images(flight, steps, scale), steps, strict=True):
        last = step == flight.steps
        shown = stride / (flight.steps_per_second * speed)
        yield Picture(image, HOLD_SECONDS if last else shown)


def poster(flight: Flight, scale: float = _POSTER_SCALE) -> Image.Image:
    """A flight in one picture: the path, ghosts of the lander every half second, and the end.

    Args:
        flight: the flight to show; for environments other than the lander, its last frame is shown.
        scale: 1 is 600 pixels wide.
    """
    if flight.frames is not None:
        return _opened(flight.frames[-1])
    return Scene(flight, scale).composite()


def show_window(env_id: str, policy: Policy, seed: int, name: str) -> Flight:
    """Show one episode live in Gymnasium's window.

    Args:
        env_id: Gymnasium id.
        policy: chooses the actions.
        seed: environment seed of the start.
        name: name of the policy.

    Raises:
        UserError: there is no display, or the environment cannot be made.
    """
    _check_display()
    made = environment.make_env(env_id, render_mode="human")
    try:
        if made.env.render_mode != "human":
            raise UserError(
                f"out = window: environment {env_id} opens no window (its render_mode is "
                f"{made.env.render_mode!r})"
            )
        flight = fly(made, policy, env_id, seed, name)
        time.sleep(HOLD_SECONDS)
    finally:
        made.env.close()
    return flight


def _check_display() -> None:
    # Gymnasium must be imported first, to keep pygame from printing a greeting
    import pygame  # noqa: PLC0415 - only a window needs it

    none_here = UserError("out = window: there is no display; write a .gif or .mp4 instead")
    chosen = "SDL_VIDEODRIVER" in os.environ
    servers = "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    if sys.platform == "linux" and not (chosen or servers):
        raise none_here
    try:
        pygame.display.init()
    except pygame.error:
        raise none_here from None
    # SDL falls back to this driver instead of failing
    if pygame.display.get_driver() == "offscreen" and not chosen:
        pygame.display.quit()
        raise none_here


def _as_sequence(flights: Flight | Sequence[Flight]) -> Sequence[Flight]:
    return [flights] if isinstance(flights, Flight) else flights


def _speed(flights: Sequence[Flight]) -> float:
    """How many times faster than real time a film of these flights is."""
    return max(1.0, sum(each.steps / each.steps_per_second for each in flights) / MOST_SECONDS)


def _stride(flight: Flight, fps: float, speed: float) -> int:
    return max(1, round(flight.steps_per_second * speed / fps))


def _images(flight: Flight, steps: Sequence[int], scale: float = 1.0) -> Iterator[Image.Image]:
    if flight.frames is not None:
        drawn = flight.frame_steps
        # the latest picture at or before each step
        at = steps if drawn is None else (np.searchsorted(drawn, steps, "right") - 1).tolist()
        yield from (_opened(flight.frames[index]) for index in at)
        return
    scene = Scene(flight, scale)
    for since, step in pairwise([0, *steps]):
        yield scene.frame(step, since, outcome=step == flight.steps)


def _opened(png: bytes) -> Image.Image:
    return Image.open(io.BytesIO(png)).convert("RGB")


def _samples(flight: Flight) -> Iterator[Image.Image]:
    steps = np.linspace(0, flight.steps, _SAMPLES).astype(int)
    return _images(flight, steps.tolist())
