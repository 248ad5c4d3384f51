"""Pictures, each shown for a time, as a GIF or an H.264 film."""

import subprocess
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import IO, NamedTuple, cast

import imageio_ffmpeg
import numpy as np
from PIL import Image

from touchdown.core import files

_COLOURS = 255  # of a GIF's 256; the last one means "as before"


class Picture(NamedTuple):
    """One picture of a film and how long it is shown."""

    image: Image.Image
    seconds: float


def write_gif(
    film: Iterable[Picture],
    samples: Iterable[Image.Image],
    path: Path,
    *,
    follow: bool = True,
) -> None:
    """Write pictures as an animated GIF that loops forever.

    Args:
        film: its pictures; at least one.
        samples: pictures of the film that its palette is based on.
        path: the file.
        follow: False for a file of a run's folder, see `files.write_through`.

    Raises:
        UserError: the file cannot be written.
    """
    palette = _palette(samples)
    durations: list[int] = []

    def frames() -> Iterator[Image.Image]:
        for image, seconds in film:
            # GIF counts hundredths of a second; the writer reads a duration after its picture
            durations.append(10 * round(100 * seconds))
            yield image.quantize(palette=palette, dither=Image.Dither.NONE)

    def write(temporary: Path) -> None:
        drawn = frames()
        next(drawn).save(
            temporary,
            "GIF",
            save_all=True,
            append_images=drawn,
            duration=durations,
            loop=0,
            optimize=True,  # only what changes from picture to picture is stored
        )

    _write(path, write, follow=follow)


def write_mp4(film: Iterable[Picture], rate: Fraction, path: Path, *, follow: bool = True) -> None:
    """Write pictures as an H.264 film that every browser plays.

    Args:
        film: its pictures, all of one size; at least one.
        rate: pictures per second; a picture that is shown for longer is repeated.
        path: the file.
        follow: False for a file of a run's folder, see `files.write_through`.

    Raises:
        UserError: the file cannot be written.
    """
    _write(path, lambda temporary: _encode(temporary, iter(film), rate), follow=follow)


def _palette(images: Iterable[Image.Image]) -> Image.Image:
    """A picture whose palette fits all images.

    A colour's weight is not its area, or the sky would dominate: it grows with the root of the area
    and with the saturation, so that flames, flags and letters are represented.
    """
    pixels = np.concatenate([np.asarray(image).reshape(-1, 3) for image in images])
    codes = pixels.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    colours, counts = np.unique(codes, return_counts=True)
    bands = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=-1).astype(np.uint8)
    chroma = bands.max(1).astype(int) - bands.min(1)
    weights = np.minimum(np.sqrt(counts), 120) * (1 + chroma / 64) / 4
    sample = np.repeat(bands, weights.astype(int) + 1, axis=0)
    return Image.fromarray(sample[None]).quantize(
        _COLOURS, Image.Quantize.MEDIANCUT, kmeans=2, dither=Image.Dither.NONE
    )


def _write(path: Path, write: Callable[[Path], object], *, follow: bool) -> None:
    with files.refusing(str(path)):
        files.write_through(path, write, follow=follow)


def _encode(path: Path, film: Iterator[Picture], rate: Fraction) -> None:
    first = next(film)
    width, height = first.image.size
    command = [
        *(imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(rate)),
        *(
            "-i",
            "-",
            "-an",
            "-c:v",
            "libx264",
            "-preset",
            "veryfast",
            "-crf",
            "18",
            "-pix_fmt",
            "yuv420p",
        ),
        # an environment's own frames may have odd sides, which this pixel format does not allow
        *("-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-movflags", "+faststart", str(path)),
    ]
    # in a separate session, so that Ctrl-C stops us without killing a half-written film
    with subprocess.Popen(  # noqa: S603
        command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
    ) as ffmpeg:
        with suppress(BrokenPipeError):  # ffmpeg has failed; its message is read below
            for image, seconds in chain([first], film):
                for _ in range(max(1, round(seconds * rate))):
                    cast(IO[bytes], ffmpeg.stdin).write(image.tobytes())
        _, complaint = ffmpeg.communicate()
    if ffmpeg.returncode != 0:
        raise OSError(f"ffmpeg: {complaint.decode(errors='replace')}")
