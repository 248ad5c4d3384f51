"""Q-learning with a table (Algorithm 1), its SARSA variants, and value iteration."""

from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from touchdown.agents import exploration, planning, tabular_targets
from touchdown.agents.actor import ActingAgent, Actor, periods_crossed
from touchdown.agents.qtable import QTable
from touchdown.agents.states import states_of
from touchdown.config.config import Config
from touchdown.core.errors import one_line
from touchdown.core.records import Count
from touchdown.core.seeding import Streams
from touchdown.core.types import FloatArray, IntArray, Policy, Spaces, StepResult, Tensors

_Pending = list[tuple[Count, Count, float, Count] | None]
"""Of each environment the step (s, a, r, s′) whose next action is not known yet."""


class TabularAgent(ActingAgent):
    """Learns a table from each step, or plans it from the environment's model.

    An update changes one table entry, or sweeps over all of them.

    Args:
        config: all settings; its algorithm is `tabular` or `value-iteration`.
        spaces: the environment's sizes, and its model for value iteration.
        streams: the run's random generators.

    Raises:
        UserError: the config does not fit the environment.
    """

    def __init__(self, config: Config, spaces: Spaces, streams: Streams) -> None:
        super().__init__(Actor(config, spaces.num_actions, streams.exploration))
        self._config = config
        self._plan = planning.plan_of(config, spaces)
        self._states = states_of(config.table, spaces)
        self.model = QTable(self._states, spaces.num_actions, config.table)
        self.q = np.full(self.model.shape, config.table.initial_value)
        # SARSA: for each environment, the step (s, a, r, s′) whose next action is not known yet
        self._pending: list[tuple[int, int, float, int] | None] = [None] * config.training.num_envs

    def act(self, observations: FloatArray) -> IntArray:
        """ε-greedy actions: [N, D] to [N]."""
        states = self._states.states(observations)
        return self._actor.act(len(states), lambda: self.q[states])

    def observe(
        self,
        o_tm1: FloatArray,
        a_tm1: IntArray,
        steps: StepResult,
        next_observations: FloatArray,
    ) -> dict[str, float] | None:
        """Learn from one step of every environment (Algorithm 1), or sweep over the model.

        Returns:
            Metrics once per `metrics_period` updates, otherwise None: the last update's squared TD
            error (the largest of a sweep), and the mean and maximum over states of maxₐ Q(s,a).
        """
        del next_observations
        updates = self._actor.updates
        if self._plan is None:
            loss = self._learn_from(o_tm1, a_tm1, steps)
        else:
            before, period = self.env_steps, self._config.learning.update_period
            loss = 0.0
            for _ in range(periods_crossed(before, before + len(a_tm1), period)):
                loss = self._sweep(self._plan)
        self._actor.observed(steps)
        if not self._actor.metrics_due(updates):
            return None
        best = self.q.max(axis=1)
        return {"loss": loss, "mean_q": float(best.mean()), "max_q": float(best.max())}

    def _sweep(self, plan: planning.TransitionModel) -> float:
        """Sweep over all states and actions once and return the largest squared change."""
        before, self.q = self.q, planning.sweep(self.q, plan, self._config.learning.gamma)
        self._actor.updates += 1
        return float(np.square(self.q - before).max())

    def _learn_from(self, o_tm1: FloatArray, a_tm1: IntArray, steps: StepResult) -> float:
        states = self._states.states(o_tm1).tolist()
        next_states = self._states.states(steps.observations).tolist()
        actions, rewards = a_tm1.tolist(), steps.rewards.tolist()
        terminated, ended = steps.terminated.tolist(), steps.ended.tolist()
        sarsa = self._config.learning.target == "sarsa"
        loss = 0.0
        for index, step in enumerate(zip(states, actions, rewards, next_states, strict=True)):
            pending = self._pending[index]
            if pending is not None:
                loss = self._update(*pending, a_t=actions[index])
            self._pending[index] = step if sarsa and not ended[index] else None
            if terminated[index]:
                loss = self._update(*step, terminated=True)
            elif not sarsa:
                loss = self._update(*step)
            elif ended[index]:  # truncated: the action that would have been next
                a_t = int(self.act(steps.observations[index][None])[0])
                loss = self._update(*step, a_t=a_t)
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
        """Q(s,a) ← Q(s,a) + α·(Y − Q(s,a)); returns (Y − Q(s,a))²."""
        learning = self._config.learning
        discount, q_t = (0.0 if terminated else learning.gamma), self.q[s_t]
        match learning.target:
            case "q-learning":
                target = tabular_targets.q_learning_target(r_t, discount, q_t)
            case "sarsa":
                target = tabular_targets.sarsa_target(r_t, discount, q_t, a_t)
            case "expected-sarsa":
                target = tabular_targets.expected_sarsa_target(r_t, discount, q_t, self.epsilon)
        td_error = float(target - self.q[s_tm1, a_tm1])
        self.q[s_tm1, a_tm1] += self._step_size() * td_error
        self._actor.updates += 1
        return td_error * td_error

    def _step_size(self) -> float:
        learning = self._config.learning
        if not learning.learning_rate_duration:
            return learning.learning_rate
        start, end = learning.learning_rate, learning.learning_rate_end
        return exploration.linear(start, end, learning.learning_rate_duration)(self.updates)

    def weights(self) -> Tensors:
        """The table, [S, A], under the name `q`: a copy."""
        return {"q": self.q.copy()}

    def policy(self, weights: Tensors) -> Policy:
        """The greedy policy of a table.

        Raises:
            ValueError: it is no table, or has another shape or type.
        """
        return self.model.policy(self.model.params_of(weights))

    def state(self) -> dict[str, Any]:
        """The table, SARSA's steps whose next action is not known yet, and the actor's state."""
        return {"learner": {"q": self.q}, "pending": self._pending, **self._actor.state()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned.

        Raises:
            KeyError: something is missing.
            TypeError: something has the wrong type.
            ValueError: something does not fit.
        """
        self.q = self.model.params_of(state["learner"]).reshape(self.model.shape).copy()
        try:
            self._pending = msgspec.convert(state["pending"], _Pending)
        except msgspec.ValidationError as error:
            raise ValueError(f"agent.pending: {one_line(error)}") from None
        self._check_pending()
        self._actor.restore(state)

    def _check_pending(self) -> None:
        """Refuse pending steps that this environment does not have.

        Raises:
            ValueError: their number is not N, or a state or an action is out of range.
        """
        num_states, num_actions = self.model.shape
        if len(self._pending) != self._config.training.num_envs:
            raise ValueError(f"{len(self._pending)} pending steps for other environments")
        for step in self._pending:
            if step and not (max(step[0], step[3]) < num_states and step[1] < num_actions):
                raise ValueError(f"pending = {step}: must be of {num_states} states")
