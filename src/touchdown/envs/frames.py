"""The pictures that an environment draws of an episode, in bounded memory."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from touchdown.core.errors import UserError, one_line
from touchdown.envs.boundary import Boundary

MOST_BYTES = 64_000_000
"""Most bytes of pictures kept of one episode; beyond it, every second one is dropped."""
_MOST_FPS = 50  # pictures per second of a film


class NotDrawable(UserError):  # noqa: N818 - it says why there is no picture
    """An environment gives no pictures; the message says why."""


class Frames:
    """Pictures at equal intervals, as PNG files: one a step while they fit.

    Args:
        env: an environment made with the render mode `rgb_array`.
        steps_per_second: steps per second of simulated time.
        most_bytes: when the files have more bytes, every second one is dropped, and from then on
            every second one is not drawn.

    Raises:
        NotDrawable: the environment has another render mode.
    """

    def __init__(
        self, env: Boundary, steps_per_second: float, most_bytes: int = MOST_BYTES
    ) -> None:
        if env.render_mode != "rgb_array":
            raise NotDrawable(
                f"environment {env.name}: draws no pictures (its render_mode is "
                f"{env.render_mode!r}, must be 'rgb_array')"
            )
        self._env = env
        self._stride = max(1, round(steps_per_second / _MOST_FPS))
        self._most_bytes = most_bytes
        self._shape: tuple[int, ...] = ()
        self._files: dict[int, bytes] = {}
        self._bytes = 0

    def look(self, step: int, *, last: bool = False) -> None:
        """Draw the environment after `step` steps, if the film needs it.

        Args:
            step: steps since the reset.
            last: whether the episode has ended; its last picture is always kept.

        Raises:
            NotDrawable: the environment drew no picture, or one of another size.
        """
        if step % self._stride and not last:
            return
        try:
            picture = self._env.picture()
        except UserError as error:
            raise NotDrawable(one_line(error)) from error
        if self._shape and picture.shape != self._shape:
            raise NotDrawable(
                f"environment {self._env.name}: render() returned uint8{picture.shape} at step "
                f"{step}, must be uint8{self._shape} as before"
            )
        self._shape = picture.shape
        file = io.BytesIO()
        Image.fromarray(picture).save(file, "PNG", compress_level=1)
        self._files[step] = file.getvalue()
        self._bytes += len(self._files[step])
        while self._bytes > self._most_bytes and len(self._files) > 2:
            self._thin(step if last else None)

    @property
    def files(self) -> tuple[bytes, ...]:
        """The PNG files, [F]."""
        return tuple(self._files.values())

    @property
    def steps(self) -> NDArray[np.int64]:
        """The steps at which they were drawn, from 0 to the last, [F]."""
        return np.array(list(self._files), np.int64)

    def _thin(self, last: int | None) -> None:
        self._stride *= 2
        self._files = {
            step: file
            for step, file in self._files.items()
            if step % self._stride == 0 or step == last
        }
        self._bytes = sum(map(len, self._files.values()))
