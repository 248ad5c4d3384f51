"""A transition, as a value and as a packed record in the replay memory."""

from typing import NamedTuple

import numpy as np

from touchdown.core.types import FloatArray


class Transition(NamedTuple):
    """One transition (s, a, r, γ, s′) over one or more steps."""

    o_tm1: FloatArray
    """[D]"""
    a_tm1: int
    r_t: float
    discount_t: float
    """γⁿ, or 0 if the episode terminated."""
    terminated: bool
    a_t: int
    """The next action, if the TD target needs it; else 0."""
    o_t: FloatArray
    """[D]"""


def transition_dtype(observation_size: int) -> np.dtype[np.void]:
    """The dtype of a packed transition: 4-byte fields only, so a batch is one gather and one copy.

    `terminated` is stored in addition to `discount_t` because with γ = 0 every discount is zero;
    `a_t`, the next action, is set only if the TD target needs it.
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
    """The index of each field's first 4-byte entry in a packed transition."""
    fields = transition_dtype(observation_size).fields or {}
    return {name: offset // 4 for name, (_, offset, *_) in fields.items()}
