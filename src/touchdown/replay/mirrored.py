"""Mirror images of transitions."""

import numpy as np

from touchdown.config.config import Config
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray, IntArray, Mirror, Spaces
from touchdown.replay.transition import Transition


def mirror_of(config: Config, spaces: Spaces) -> Mirror | None:
    """The symmetry by which an agent learns from images; None if its config asks for none.

    Raises:
        UserError: the config asks for images, but the environment declares no symmetry.
    """
    if not (config.replay.mirrored or config.rollout.mirror_half):
        return None
    if spaces.mirror is None:
        name = "mirrored" if config.replay.mirrored else "mirror_half"
        raise UserError(
            f"{name} = True: must be False for env_id = {config.env_id!r}, which declares no "
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
        self._actions = np.array(mirror.actions)

    def observations(self, observations: FloatArray) -> FloatArray:
        """The images of observations, [..., D]."""
        return observations[..., self._order] * self._signs

    def actions(self, actions: IntArray) -> IntArray:
        """The images of actions, [...]."""
        return self._actions[actions]

    def __call__(self, transition: Transition) -> Transition:
        """The image, with the same reward and discount."""
        return transition._replace(
            o_tm1=self.observations(transition.o_tm1),
            a_tm1=int(self._actions[transition.a_tm1]),
            a_t=int(self._actions[transition.a_t]),
            o_t=self.observations(transition.o_t),
        )
