"""Pictures as `data:` URLs, embedded in a page."""

import io
from base64 import b64encode
from pathlib import Path
from typing import NamedTuple

from PIL import Image

from touchdown.core import limits, reading
from touchdown.core.errors import UserError, one_line


class Moving(NamedTuple):
    """A film as two `data:` URLs, and its size in pixels."""

    film: str
    still: str
    """Its last frame."""
    width: int
    height: int


def data_url(path: Path, media_type: str) -> str:
    """A file as a `data:` URL.

    Raises:
        UserError: it cannot be read.
    """
    return _address(reading.read_bytes(path, limits.PICTURE_BYTES), media_type)


def film_and_still(gif: Path) -> Moving:
    """An animation, and its last frame for readers who prefer less motion.

    Raises:
        UserError: the file cannot be read, or is not a picture.
    """
    data = reading.read_bytes(gif, limits.PICTURE_BYTES)
    still = io.BytesIO()
    try:
        with Image.open(io.BytesIO(data)) as film:
            film.seek(getattr(film, "n_frames", 1) - 1)
            film.convert("RGB").quantize(256).save(still, "PNG", optimize=True)
            width, height = film.size
    except (OSError, EOFError, ValueError) as error:
        raise UserError(f"{gif}: not a complete GIF: {one_line(error)}") from None
    return Moving(
        _address(data, "image/gif"), _address(still.getvalue(), "image/png"), width, height
    )


def _address(data: bytes, media_type: str) -> str:
    return f"data:{media_type};base64,{b64encode(data).decode()}"
