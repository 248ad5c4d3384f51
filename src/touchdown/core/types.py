"""The values that packages pass to each other."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Outcome = Literal["landed", "crashed", "out of bounds", "timed out", "terminated"]
"""How an episode ended; `terminated` is for environments other than the lander."""

FloatArray = NDArray[np.floating[Any]]
IntArray = NDArray[np.integer[Any]]
RecordArray = NDArray[np.void]
Tensors = dict[str, NDArray[Any]]
"""Arrays by name, as a safetensors file holds them."""


class Policy(Protocol):
    """Chooses actions: a trained network, a controller, a random policy."""

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, D] to [N]."""
        ...


class SeededPolicy(Policy, Protocol):
    """A policy with random actions, which depend on the start and the step of an episode."""

    def act_at(self, observations: FloatArray, seeds: IntArray, steps: IntArray) -> IntArray:
        """An action for each observation: [N, D], [N] and [N] to [N].

        Args:
            observations: those to act on.
            seeds: environment seed of the start of each observation's episode.
            steps: steps before each observation in its episode.
        """
        ...


def actions_of(
    policy: Policy, observations: FloatArray, seeds: IntArray, steps: IntArray
) -> IntArray:
    """A policy's action for each observation: [N, D], [N] and [N] to [N].

    Args:
        policy: chooses the actions; only a `SeededPolicy` uses seeds and steps.
        observations: see `SeededPolicy.act_at`.
        seeds: see there.
        steps: see there.
    """
    # in every step of every environment: a check against the protocol takes ten times as long
    act_at = getattr(policy, "act_at", None)
    return policy.act(observations) if act_at is None else act_at(observations, seeds, steps)


@runtime_checkable
class ValuePolicy(Policy, Protocol):
    """A policy with action values."""

    def values(self, observations: FloatArray) -> FloatArray:
        """Q(s,·) of each observation: [N, D] to [N, A]."""
        ...


@runtime_checkable
class Described(Protocol):
    """A policy of a network or a table of ours, which is made again without its agent's code."""

    def describe(self) -> dict[str, Any]:
        """The config of the network or table as JSON values, under the key `network` or `table`."""
        ...


class Mirror(NamedTuple):
    """A symmetry of an environment: the mirror image of a transition is as likely as itself.

    In the image, number i of an observation is `signs[i] * observation[order[i]]`, action a is
    `actions[a]`, and the reward is the same. The image of an image is the transition itself.
    """

    order: tuple[int, ...]
    """[D], a permutation of the observation's numbers."""
    signs: tuple[float, ...]
    """[D], 1 or -1."""
    actions: tuple[int, ...]
    """[A], a permutation of the actions."""


class Spaces(NamedTuple):
    """What an agent needs to know about an environment."""

    observation_size: int
    """D"""
    num_actions: int
    """A"""
    num_states: int | None = None
    """Number of states if observations are Discrete (one-hot, so equal to D); None for a Box."""
    low: tuple[float, ...] = ()
    """Lower and upper bound of each dimension, [D]; infinite where there is none."""
    high: tuple[float, ...] = ()
    transitions: Mapping[int, Mapping[int, Any]] | None = None
    """The transition model, as Gymnasium's toy text has it; None if it is not known."""
    mirror: Mirror | None = None
    """The environment's mirror symmetry; None if it declares none."""


class StepResult(NamedTuple):
    """One step of N environments."""

    observations: FloatArray
    """[N, D]: the last of the episode where one ended, before any reset."""
    rewards: FloatArray
    """[N]"""
    terminated: NDArray[np.bool_]
    """[N]: the episode reached a terminal state."""
    truncated: NDArray[np.bool_]
    """[N]: the time limit was reached."""

    @property
    def ended(self) -> NDArray[np.bool_]:
        """[N]: terminated or truncated."""
        return self.terminated | self.truncated
