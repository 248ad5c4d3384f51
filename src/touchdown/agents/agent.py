"""The contract between training and an agent."""

from collections.abc import Mapping
from typing import Any, Protocol

from touchdown.core.types import FloatArray, IntArray, Policy, StepResult, Tensors


class Agent(Protocol):
    """Acts in N environments at once and learns from the steps.

    The class is called with the config, the environment's `Spaces`, the run's `Streams` and the
    config's `options` as keyword arguments.

    Two attributes are optional. Training records them if they exist: `epsilon`, the probability of
    a random action, and `updates`, the number of updates so far.
    """

    def act(self, observations: FloatArray) -> IntArray:
        """Choose an action in each environment, with exploration: [N, D] to [N]."""
        ...

    def observe(
        self,
        o_tm1: FloatArray,
        a_tm1: IntArray,
        steps: StepResult,
        next_observations: FloatArray,
    ) -> Mapping[str, float] | None:
        """Observe one step of every environment, and learn when an update is due.

        Args:
            o_tm1: the observations that the actions were chosen for, [N, D].
            a_tm1: the actions, [N].
            steps: the results of the actions.
            next_observations: the observations that the next actions will be chosen for, [N, D]:
                `steps.observations`, or the first of the next episode where one ended.

        Returns:
            Metrics of the latest update by name, such as `loss` and `mean_q`, if training should
            record them now; otherwise None.
        """
        ...

    def weights(self) -> Tensors:
        """Copies of the parameters of the greedy policy, by name."""
        ...

    def policy(self, weights: Tensors) -> Policy:
        """The greedy policy of these weights, which may come from a file.

        Raises:
            ValueError: their names, shapes or types are not those of `weights`.
        """
        ...

    def state(self) -> dict[str, Any]:
        """Everything that `restore` needs to continue identically, for a checkpoint.

        Groups of named arrays, each a dictionary, and plain JSON values.
        """
        ...

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the result of `state` in a fresh agent.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        ...
