"""The values that the parts hand each other."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Outcome = Literal["landed", "crashed", "out of bounds", "timed out", "terminated"]
"""How an episode ended; `terminated` is for worlds that are not the lander's."""

FloatArray = NDArray[np.floating[Any]]
IntArray = NDArray[np.integer[Any]]
RecordArray = NDArray[np.void]
Tensors = dict[str, NDArray[Any]]
"""Arrays by name, as a safetensors file holds them."""


class Policy(Protocol):
    """Whatever chooses actions: a trained network, a controller, chance."""

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, D] to [N]."""
        ...


@runtime_checkable
class ValuePolicy(Policy, Protocol):
    """A policy that knows what its actions are worth."""

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


class StepResult(NamedTuple):
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
