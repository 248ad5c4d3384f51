"""Q-learning with a table: Algorithm 1, SARSA beside it, and a plan where the model is known."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchdown.agents import exploration, tabular_math
from touchdown.agents.agent import Tensors
from touchdown.agents.exploration import EpsilonGreedy
from touchdown.agents.tabular_math import Grid, Model, OneHot, States
from touchdown.config.config import Config
from touchdown.config.sections import TableConfig
from touchdown.core.errors import UserError, one_line
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, IntArray, Spaces, StepResult

_NO_BOUND = 1e30  # some worlds say float32's greatest number where they have no bound


def states_of(config: TableConfig, spaces: Spaces) -> States:
    """How observations of a world become states.

    Raises:
        UserError: `bins` do not fit the world.
    """
    if spaces.num_states is not None:
        if config.bins:
            raise UserError(
                f"bins = {config.bins!r}: must stay () in a world of {spaces.num_states} states, "
                "which are not cut any more"
            )
        return OneHot(spaces.num_states)
    size = spaces.observation_size
    if len(config.bins) != size:
        raise UserError(
            f"bins = {config.bins!r}: must be {size} numbers, into how many parts a table cuts "
            f"each of the observation's dimensions, such as --bins {' '.join(['4'] * size)}"
        )
    for name in ("low", "high"):
        bounds = getattr(config, f"bins_{name}") or getattr(spaces, name)
        if not all(abs(bound) < _NO_BOUND for bound in bounds):
            raise UserError(
                f"bins_{name} = (): must be {size} numbers, as this world's own bounds are not "
                f"all finite: {', '.join(f'{bound:.4g}' for bound in bounds)}"
            )
    try:
        return Grid(config.bins, config.bins_low or spaces.low, config.bins_high or spaces.high)
    except ValueError as error:
        raise UserError(f"bins = {config.bins!r}: {one_line(error)}") from None


def plan_of(config: Config, spaces: Spaces) -> Model | None:
    """The world's own model where value iteration plans with it, None for learning from steps.

    Raises:
        UserError: the model is not known.
    """
    if config.algorithm != "value-iteration":
        return None
    if spaces.transitions is None:
        raise UserError(
            f"env_id {config.env_id!r}: its model is not known; value iteration needs "
            "one, as FrozenLake-v1, CliffWalking-v1 and Taxi-v4 have"
        )
    try:
        return tabular_math.read_model(spaces.transitions)
    except ValueError as error:
        raise UserError(
            f"env_id {config.env_id!r}: its model cannot be read: {one_line(error)}"
        ) from None


class QTable:
    """A table of action values; its flat parameters are its rows one after the other, [S·A].

    Args:
        states: numbers an observation's state.
        num_actions: A.
        config: how the states came about.
    """

    def __init__(self, states: States, num_actions: int, config: TableConfig) -> None:
        self.states = states
        self.shape = states.num_states, num_actions
        self._config = config

    def layers(self, params: FloatArray) -> dict[str, FloatArray]:
        """The table under the name `q`, [S, A]."""
        return {"q": params.reshape(self.shape)}

    def params_of(self, layers: Mapping[str, NDArray[Any]]) -> FloatArray:
        """Flat parameters from what `layers` gave.

        Raises:
            ValueError: it is no table, or one of another shape or type.
        """
        if list(layers) != ["q"]:
            raise ValueError(f"it holds {sorted(layers)}, a table has q")
        q = layers["q"]
        if q.shape != self.shape or q.dtype != np.float64:
            raise ValueError(f"q is {q.dtype}{q.shape}, must be float64{self.shape}")
        return q.ravel()

    def policy(self, params: FloatArray) -> "TablePolicy":
        """Flies the best action of each state."""
        return TablePolicy(self.states, params.reshape(self.shape))

    def describe(self) -> dict[str, Any]:
        """The table's config, by the key that a file of weights has it under."""
        config = self._config
        return {
            "table": {
                "bins": config.bins,
                "bins_low": config.bins_low,
                "bins_high": config.bins_high,
            }
        }


class TablePolicy:
    """Takes the best action of a table, the first of equals.

    Args:
        states: numbers an observation's state.
        q: [S, A].
    """

    def __init__(self, states: States, q: FloatArray) -> None:
        self._states = states
        self.q = q

    def act(self, observations: FloatArray) -> IntArray:
        """The best action of each observation: [N, D] to [N]."""
        return self.values(observations).argmax(axis=1)

    def values(self, observations: FloatArray) -> FloatArray:
        """Q(s,·) of each observation: [N, D] to [N, A]."""
        return self.q[self._states.states(observations)]


class TabularAgent:
    """Learns a table from each step, or plans it from the model.

    Args:
        config: all settings; its algorithm is `tabular` or `value-iteration`.
        spaces: the world's sizes, and its model for value iteration.
        streams: the run's generators.

    Raises:
        UserError: the config does not fit the world.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams) -> None:
        self._config = config
        self._plan = plan_of(config, spaces)
        self._states = states_of(config.table, spaces)
        self.model = QTable(self._states, spaces.num_actions, config.table)
        self.q = np.full(self.model.shape, config.table.initial_value)
        self.observations = 0
        self.updates = 0
        self._explorer = EpsilonGreedy(config.exploration, spaces.num_actions, streams.exploration)
        # SARSA's step of each world that waits for the next action: s, a, r, s′
        self._waiting: list[tuple[int, int, float, int] | None] = [None] * config.training.num_envs

    @property
    def epsilon(self) -> float:
        """Probability of a random action."""
        return self._explorer.epsilon

    def begin_episode(self, ended: int) -> None:
        """Set ε, where its schedule counts episodes."""
        self._explorer.begin_episode(ended, self.observations)

    def act(self, observations: FloatArray) -> IntArray:
        """ε-greedy actions: [N, D] to [N]."""
        states = self._states.states(observations)
        return self._explorer.act(len(states), lambda: self.q[states])

    def observe(
        self, o_tm1: FloatArray, a_tm1: IntArray, steps: StepResult, following: FloatArray
    ) -> dict[str, float] | None:
        """Learn from one step of each world (Algorithm 1), or sweep over the model once.

        Returns:
            Metrics whenever another `metrics_period` updates are done: the last update's squared
            TD error (of a sweep its largest), and the mean and the greatest of the best values.
        """
        del following
        before, self.observations = self.observations, self.observations + len(a_tm1)
        updates = self.updates
        if self._plan is not None:
            period = self._config.learning.update_period
            loss = 0.0
            for _ in range(self.observations // period - before // period):
                loss = self._sweep()
        else:
            loss = self._learn_from(o_tm1, a_tm1, steps)
        self._explorer.observed(self.observations)
        period = self._config.training.metrics_period
        if self.updates // period == updates // period:
            return None
        best = self.q.max(axis=1)
        return {"loss": loss, "mean_q": float(best.mean()), "max_q": float(best.max())}

    def _sweep(self) -> float:
        assert self._plan is not None  # noqa: S101 - asked by the caller
        before, self.q = self.q, tabular_math.sweep(self.q, self._plan, self._config.learning.gamma)
        self.updates += 1
        return float(np.square(self.q - before).max())

    def _learn_from(self, o_tm1: FloatArray, a_tm1: IntArray, steps: StepResult) -> float:
        states = self._states.states(o_tm1).tolist()
        next_states = self._states.states(steps.observations).tolist()
        actions, rewards = a_tm1.tolist(), steps.rewards.tolist()
        terminated, ended = steps.terminated.tolist(), steps.ended.tolist()
        waits = self._config.learning.target == "sarsa"
        loss = 0.0
        for index, step in enumerate(zip(states, actions, rewards, next_states, strict=True)):
            earlier = self._waiting[index]
            if earlier is not None:
                loss = self._update(*earlier, a_t=actions[index])
            self._waiting[index] = step if waits and not ended[index] else None
            if terminated[index]:
                loss = self._update(*step, terminated=True)
            elif not waits:
                loss = self._update(*step)
            elif ended[index]:  # cut off: the action that would have come
                after = int(self.act(steps.observations[index][None])[0])
                loss = self._update(*step, a_t=after)
        return loss

    def _update(
        self,
        s_tm1: int,
        a_tm1: int,
        r_t: float,
        s_t: int,
        *,
        a_t: int = 0,
        terminated: bool = False,
    ) -> float:
        """Q(s,a) ← Q(s,a) + α·(Y − Q(s,a)); gives (Y − Q(s,a))²."""
        learning = self._config.learning
        discount, q_t = (0.0 if terminated else learning.gamma), self.q[s_t]
        match learning.target:
            case "q-learning":
                target = tabular_math.q_learning_target(r_t, discount, q_t)
            case "sarsa":
                target = tabular_math.sarsa_target(r_t, discount, q_t, a_t)
            case "expected-sarsa":
                target = tabular_math.expected_sarsa_target(r_t, discount, q_t, self.epsilon)
        td_error = float(target - self.q[s_tm1, a_tm1])
        self.q[s_tm1, a_tm1] += self._step_size() * td_error
        self.updates += 1
        return td_error * td_error

    def _step_size(self) -> float:
        learning = self._config.learning
        if not learning.learning_rate_duration:
            return learning.learning_rate
        start, end = learning.learning_rate, learning.learning_rate_end
        return exploration.linear(start, end, learning.learning_rate_duration)(self.updates)

    def recall(
        self, index: int, o_tm1: FloatArray, a_tm1: int, r_t: float, o_t: FloatArray
    ) -> None:
        """Go once more through a step that was observed before a checkpoint."""
        if self._config.learning.target == "sarsa":
            s_tm1, s_t = self._states.states(np.stack((o_tm1, o_t))).tolist()
            self._waiting[index] = s_tm1, a_tm1, r_t, s_t

    def params(self) -> FloatArray:
        """The table, [S·A]: a copy."""
        return self.q.ravel().copy()

    def tensors(self) -> dict[str, Tensors]:
        """The table."""
        return {"learner": {"q": self.q}}

    def facts(self) -> dict[str, Any]:
        """Counts and ε."""
        return {
            "observations": self.observations,
            "updates": self.updates,
            "epsilon": self.epsilon,
        }

    def restore(self, tensors: Mapping[str, Tensors], facts: Mapping[str, Any]) -> None:
        """Go on from a checkpoint.

        Raises:
            KeyError: something is missing.
            TypeError: something is of another kind.
            ValueError: something does not fit.
        """
        self.q = self.model.params_of(tensors["learner"]).reshape(self.model.shape).copy()
        self.observations, self.updates = facts["observations"], facts["updates"]
        self._explorer.epsilon = float(facts["epsilon"])
