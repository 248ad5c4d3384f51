"""Pictures as `data:` addresses, which a page carries with it."""

import io
from base64 import b64encode
from pathlib import Path
from typing import NamedTuple

from PIL import Image

from touchdown.core.errors import UserError, one_line


class Moving(NamedTuple):
    """A film in two addresses, and its size in pixels."""

    film: str
    still: str
    """Its last frame: where it ended."""
    width: int
    height: int


def data_url(path: Path, media_type: str) -> str:
    """A file as an address that holds it.

    Raises:
        UserError: it cannot be read.
    """
    return _address(_read(path), media_type)


def film_and_still(gif: Path) -> Moving:
    """An animation, and its last frame for whoever wants less motion.

    Raises:
        UserError: the file cannot be read, or is no picture.
    """
    data = _read(gif)
    still = io.BytesIO()
    try:
        with Image.open(io.BytesIO(data)) as film:
            film.seek(getattr(film, "n_frames", 1) - 1)
            film.convert("RGB").quantize(256).save(still, "PNG", optimize=True)
            width, height = film.size
    except (OSError, EOFError, ValueError) as error:
        raise UserError(f"{gif}: not a whole GIF: {one_line(error)}") from None
    return Moving(
        _address(data, "image/gif"), _address(still.getvalue(), "image/png"), width, height
    )


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {one_line(error)}") from None


def _address(data: bytes, media_type: str) -> str:
    return f"data:{media_type};base64,{b64encode(data).decode()}"
