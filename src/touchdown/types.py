"""The values that the parts hand each other."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import jax
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

Outcome = Literal["landed", "crashed", "out of bounds", "timed out", "terminated"]
"""How an episode ended; `terminated` is for worlds that are not the lander's."""

FloatArray = NDArray[np.floating[Any]]
IntArray = NDArray[np.integer[Any]]
RecordArray = NDArray[np.void]
Params = Float[jax.Array, " P"]
"""All weights of a network in one flat vector: few buffers and few kernels make updates fast."""


class Pilot(Protocol):
    """Whatever chooses actions: a trained network, a controller, chance."""

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, D] to [N]."""
        ...


@runtime_checkable
class ValuePilot(Pilot, Protocol):
    """A pilot that knows what its actions are worth."""

    def values(self, observations: FloatArray) -> FloatArray:
        """Q(s,·) of each observation: [N, D] to [N, A]."""
        ...


class Spaces(NamedTuple):
    """What an agent is told of a world."""

    observation_size: int
    """D"""
    num_actions: int
    """A"""
    num_states: int | None = None
    """Of a Discrete world, whose observations are one-hot, D of them; None of a Box."""
    low: tuple[float, ...] = ()
    """The least and the greatest of each dimension of a Box, [D]; infinite where there is none."""
    high: tuple[float, ...] = ()
    transitions: Mapping[int, Mapping[int, Any]] | None = None
    """What may follow a state and an action, as Gymnasium's toy worlds have it; None of others."""


class Steps(NamedTuple):
    """What came of one step of N worlds side by side."""

    observations: FloatArray
    """[N, D]: where an episode ended, its last."""
    rewards: FloatArray
    """[N]"""
    terminated: NDArray[np.bool_]
    """[N]: the world ended."""
    truncated: NDArray[np.bool_]
    """[N]: the time limit was reached."""

    @property
    def ended(self) -> NDArray[np.bool_]:
        """[N]: the episode is over, one way or the other."""
        return self.terminated | self.truncated


class Transition(NamedTuple):
    """A batch of transitions in the field's notation."""

    o_tm1: Float[jax.Array, "B D"]
    a_tm1: Int[jax.Array, " B"]
    r_t: Float[jax.Array, " B"]
    discount_t: Float[jax.Array, " B"]
    o_t: Float[jax.Array, "B D"]
    a_t: Int[jax.Array, " B"]


def transition_dtype(observation_size: int) -> np.dtype[np.void]:
    """A transition as one record of 4-byte fields, so that a batch is one gather and one copy.

    `terminated` is kept beside `discount_t` because γ = 0 makes every discount zero; `a_t`, the
    action after, is known only where a target asks for it.
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


def unpack_transitions(words: Float[jax.Array, "B W"], observation_size: int) -> Transition:
    """Records viewed as rows of 32-bit words, back to named arrays (inside a compiled function).

    Args:
        words: `records.view(np.float32).reshape(B, -1)` of records of `transition_dtype`.
        observation_size: D, the length of an observation.
    """
    d = observation_size
    return Transition(
        o_tm1=words[:, :d],
        a_tm1=jax.lax.bitcast_convert_type(words[:, d], np.int32),
        r_t=words[:, d + 1],
        discount_t=words[:, d + 2],
        o_t=words[:, d + 5 :],
        a_t=jax.lax.bitcast_convert_type(words[:, d + 4], np.int32),
    )
