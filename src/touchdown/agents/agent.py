"""What a run asks of an agent, whatever it learns and however."""

from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import NDArray

from touchdown.core.types import FloatArray, IntArray, Policy, StepResult

Tensors = dict[str, NDArray[Any]]


class Model(Protocol):
    """What is learnt, as a function of flat parameters [P]: a network's, or a table's."""

    def layers(self, params: FloatArray) -> Mapping[str, Any]:
        """The parameters by name, each in its own shape."""
        ...

    def params_of(self, layers: Tensors) -> FloatArray:
        """Flat parameters from those that `layers` names.

        Raises:
            ValueError: they are others than this model's, or of other shapes or types.
        """
        ...

    def policy(self, params: FloatArray) -> Policy:
        """A greedy policy."""
        ...

    def describe(self) -> dict[str, Any]:
        """What makes this model again, as values for JSON."""
        ...


class Agent(Protocol):
    """Acts in N worlds side by side, and learns from what comes of it."""

    observations: int
    """Environment steps observed so far."""
    updates: int

    @property
    def epsilon(self) -> float:
        """Probability of a random action."""
        ...

    @property
    def model(self) -> Model:
        """What the parameters are of."""
        ...

    def begin_episode(self, ended: int) -> None:
        """One of the worlds begins an episode, the first or one after `ended` others."""
        ...

    def act(self, observations: FloatArray) -> IntArray:
        """An exploring action in each world: [N, D] to [N]."""
        ...

    def observe(
        self, o_tm1: FloatArray, a_tm1: IntArray, steps: StepResult, following: FloatArray
    ) -> dict[str, float] | None:
        """One step of all worlds.

        Args:
            o_tm1: what the actions were chosen for, [N, D].
            a_tm1: the actions, [N].
            steps: what came of them.
            following: what is acted on next, [N, D]: `steps.observations`, or the start of the next
                episode.

        Returns:
            Metrics of an update, now and then: `loss`, and others by name.
        """
        ...

    def recall(
        self, index: int, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray
    ) -> None:
        """Go once more through a step of one world that was observed before a checkpoint.

        It ends no episode, and whatever it taught is known already.
        """
        ...

    def params(self) -> FloatArray:
        """What has been learnt so far, [P]: a copy."""
        ...

    def tensors(self) -> dict[str, Tensors]:
        """All its arrays, in named groups, for a checkpoint."""
        ...

    def facts(self) -> dict[str, Any]:
        """All else that it knows, as values for JSON."""
        ...

    def restore(self, tensors: Mapping[str, Tensors], facts: Mapping[str, Any]) -> None:
        """Take over what `tensors` and `facts` gave.

        Raises:
            KeyError: something is missing.
            TypeError: something is of another kind.
            ValueError: something does not fit.
        """
        ...
