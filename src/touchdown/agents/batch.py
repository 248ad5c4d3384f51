"""Inputs of the JAX learners: flat parameters and batches of transitions."""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from touchdown.replay.transition import field_offsets

Params = Float[jax.Array, " P"]
"""All weights of a network in one flat vector: fewer buffers and kernels make updates fast."""


class TransitionBatch(NamedTuple):
    """A batch of transitions, in standard notation."""

    o_tm1: Float[jax.Array, "B D"]
    a_tm1: Int[jax.Array, " B"]
    r_t: Float[jax.Array, " B"]
    discount_t: Float[jax.Array, " B"]
    a_t: Int[jax.Array, " B"]
    o_t: Float[jax.Array, "B D"]


def unpack_transitions(packed: Float[jax.Array, "B W"], observation_size: int) -> TransitionBatch:
    """Packed transitions as named arrays (inside a compiled function).

    Args:
        packed: `records.view(np.float32).reshape(B, -1)` of records of `transition_dtype`.
        observation_size: D, the length of an observation.
    """
    at = field_offsets(observation_size)

    def vectors(name: str) -> Float[jax.Array, "B D"]:
        return packed[:, at[name] : at[name] + observation_size]

    def integers(name: str) -> Int[jax.Array, " B"]:
        return jax.lax.bitcast_convert_type(packed[:, at[name]], np.int32)

    return TransitionBatch(
        o_tm1=vectors("o_tm1"),
        a_tm1=integers("a_tm1"),
        r_t=packed[:, at["r_t"]],
        discount_t=packed[:, at["discount_t"]],
        a_t=integers("a_t"),
        o_t=vectors("o_t"),
    )
