"""One transition, on its way into a replay memory and as a packed record in it."""

from typing import NamedTuple

import numpy as np

from touchdown.core.types import FloatArray


class Transition(NamedTuple):
    """One transition (s, a, r, γ, s′) of one or more steps, on its way into a memory."""

    o_tm1: FloatArray
    """[D]"""
    a_tm1: int
    r_t: float
    discount_t: float
    """γⁿ, or 0 where the episode terminated."""
    o_t: FloatArray
    """[D]"""
    terminated: bool
    a_t: int = 0
    """The next action, where the TD target needs it."""


def transition_dtype(observation_size: int) -> np.dtype[np.void]:
    """A transition as one record of 4-byte fields, so that a batch is one gather and one copy.

    `terminated` is kept beside `discount_t` because γ = 0 makes every discount zero; `a_t`, the
    next action, is known only where a target asks for it.
    """
    return np.dtype(
        [
            ("o_tm1", np.float32, (observation_size,)),
            ("a_tm1", np.int32),
            ("r_t", np.float32),
            ("discount_t", np.float32),
            ("terminated", np.int32),
            ("a_t", np.int32),
            ("o_t", np.float32, (observation_size,)),
        ]
    )


def field_offsets(observation_size: int) -> dict[str, int]:
    """Where each field of a packed transition begins, in 4-byte words."""
    fields = transition_dtype(observation_size).fields or {}
    return {name: offset // 4 for name, (_, offset, *_) in fields.items()}
