"""A picture of a lander as it is now, for the render mode `rgb_array`."""

from importlib import import_module

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from touchdown.core.types import FloatArray
from touchdown.lander._engine import HELIPAD
from touchdown.lander.rules import LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE
from touchdown.lander.space import LanderStates

RENDER_MODES = ("rgb_array",)
# By name, as Gymnasium finds environments: drawing is a package above this one, which a lander that
# is not looked at does without.
_RENDERER = "touchdown.render.live"


def check_render_mode(render_mode: str | None) -> None:
    """Raise if a lander cannot be rendered in this mode.

    Raises:
        ValueError: it is neither None nor `rgb_array`.
    """
    if render_mode is not None and render_mode not in RENDER_MODES:
        raise ValueError(
            f"render_mode {render_mode!r}: must be rgb_array or None (gymnasium.make takes human "
            "too, and shows these pictures in a window)"
        )


def draw(states: LanderStates, index: int, corners: FloatArray, step: int) -> NDArray[np.uint8]:
    """The picture of one lander, RGB, [400, 600, 3].

    Args:
        states: the states of all landers.
        index: which lander to draw.
        corners: of its ground, metres, [11, 2].
        step: steps since the reset, by which the flames flicker.

    Raises:
        DependencyNotInstalled: the libraries for drawing are missing.
    """
    try:
        renderer = import_module(_RENDERER)
    except ImportError as error:
        raise DependencyNotInstalled(
            f"render_mode 'rgb_array' needs the libraries that touchdown draws with: {error}"
        ) from error
    main, side = states.engine_powers[index].tolist()
    burning = {MAIN_ENGINE} if main > 0 else set[int]()
    if side:
        burning.add(LEFT_ENGINE if side < 0 else RIGHT_ENGINE)
    bodies = np.concatenate((states.positions[index], states.angles[index][:, None]), axis=1)
    return renderer.picture(bodies, corners, HELIPAD, burning, step)
