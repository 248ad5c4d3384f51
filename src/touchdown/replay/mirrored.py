"""The mirror image of a transition."""

import numpy as np

from touchdown.config.config import Config
from touchdown.core.errors import UserError
from touchdown.core.types import Mirror, Spaces
from touchdown.replay.transition import Transition


def mirror_of(config: Config, spaces: Spaces) -> Mirror | None:
    """The symmetry by which a config's replay memory stores images; None if it stores none.

    Raises:
        UserError: the config asks for images, but the environment declares no symmetry.
    """
    if not config.replay.mirrored:
        return None
    if spaces.mirror is None:
        raise UserError(
            f"mirrored = True: must be False for env_id = {config.env_id!r}, which declares no "
            "mirror symmetry"
        )
    return spaces.mirror


class Mirrored:
    """Turns transitions into their mirror images.

    Args:
        mirror: the environment's symmetry.
    """

    def __init__(self, mirror: Mirror) -> None:
        self._order = np.array(mirror.order)
        self._signs = np.array(mirror.signs, np.float32)
        self._actions = mirror.actions

    def __call__(self, transition: Transition) -> Transition:
        """The image, with the same reward and discount."""
        return transition._replace(
            o_tm1=transition.o_tm1[self._order] * self._signs,
            a_tm1=self._actions[transition.a_tm1],
            a_t=self._actions[transition.a_t],
            o_t=transition.o_t[self._order] * self._signs,
        )
