"""The protocols of an agent and of the model that it learns."""

from collections.abc import Mapping
from typing import Any, Protocol

from touchdown.core.types import FloatArray, IntArray, Policy, StepResult, Tensors


class Model(Protocol):
    """What an agent learns, as a function of flat parameters [P]: a network or a table."""

    def layers(self, params: FloatArray) -> Mapping[str, Any]:
        """The parameters by name, each in its own shape."""
        ...

    def params_of(self, layers: Tensors) -> FloatArray:
        """Flat parameters from named ones; the inverse of `layers`.

        Raises:
            ValueError: the names, shapes or types are not those of this model.
        """
        ...

    def policy(self, params: FloatArray) -> Policy:
        """The greedy policy of these parameters."""
        ...

    def describe(self) -> dict[str, Any]:
        """What is needed to recreate this model, as JSON values."""
        ...


class Agent(Protocol):
    """Acts in N environments at once and learns from the steps."""

    @property
    def env_steps(self) -> int:
        """Environment steps observed so far, in all environments together."""
        ...

    @property
    def updates(self) -> int:
        """Updates of the parameters so far."""
        ...

    @property
    def epsilon(self) -> float:
        """The probability of a random action."""
        ...

    @property
    def model(self) -> Model:
        """The model that the parameters belong to."""
        ...

    def begin_episode(self, ended: int) -> None:
        """Note that an episode begins in one of the environments.

        Args:
            ended: number of episodes that have ended before it, 0 for the first.
        """
        ...

    def act(self, observations: FloatArray) -> IntArray:
        """Choose an action in each environment, with exploration: [N, D] to [N]."""
        ...

    def observe(
        self,
        o_tm1: FloatArray,
        a_tm1: IntArray,
        steps: StepResult,
        next_observations: FloatArray,
    ) -> dict[str, float] | None:
        """Observe one step of every environment, and learn when an update is due.

        Args:
            o_tm1: the observations that the actions were chosen for, [N, D].
            a_tm1: the actions, [N].
            steps: the results of the actions.
            next_observations: the observations that the next actions will be chosen for, [N, D]:
                `steps.observations`, or the first of the next episode where one ended.

        Returns:
            Metrics of the latest update, at least `loss` and `mean_q`, once per `metrics_period`
            updates; otherwise None.
        """
        ...

    def recall(
        self, index: int, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray
    ) -> None:
        """Observe again one step from before the checkpoint that is being restored.

        A resumed run repeats the steps of unfinished episodes, so that an agent can rebuild what it
        keeps between steps. None of these steps ends an episode, and the agent must not learn from
        them again.

        Args:
            index: index of the environment.
            o_tm1: the observation before the step, [D].
            a_tm1: the action.
            r_t: the reward.
            o_t: the observation after the step, [D].
        """
        ...

    def params(self) -> FloatArray:
        """A copy of the parameters learned so far, [P]."""
        ...

    def tensors(self) -> dict[str, Tensors]:
        """All its arrays, in named groups, for a checkpoint."""
        ...

    def facts(self) -> dict[str, Any]:
        """The rest of its state, as JSON values."""
        ...

    def restore(self, tensors: Mapping[str, Tensors], facts: Mapping[str, Any]) -> None:
        """Restore the state that `tensors` and `facts` returned.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        ...
