from typing import Any

import numpy as np
import pytest

from touchdown.agents.learners.factory import make_learner
from touchdown.agents.pqn import PQNAgent
from touchdown.core.errors import UserError
from touchdown.testing import check_agent


class PlainPQN(PQNAgent):
    def __init__(self, config, spaces, streams) -> None:
        super().__init__(config, spaces, streams, make_learner(config, spaces))


class Table:
    """Q-learning from nothing but NumPy: all that the protocol asks for, and no more."""

    def __init__(self, config, spaces, streams, *, rate: float = 0.5) -> None:
        if not 0 < rate <= 1:
            raise ValueError(f"rate = {rate}: must be above 0 and at most 1")
        self.q = np.zeros((spaces.observation_size, spaces.num_actions))
        self.rate, self.gamma, self.rng = rate, config.learning.gamma, streams.exploration

    def act(self, observations):
        random = self.rng.integers(self.q.shape[1], size=len(observations))
        best = self.q[observations.argmax(axis=1)].argmax(axis=1)
        return np.where(self.rng.random(len(observations)) < 0.5, random, best)

    def observe(self, o_tm1, a_tm1, steps, next_observations):
        del next_observations
        for s, a, r, s_t, over in zip(
            o_tm1.argmax(axis=1),
            a_tm1,
            steps.rewards,
            steps.observations.argmax(axis=1),
            steps.terminated,
            strict=True,
        ):
            target = r + (0.0 if over else self.gamma * self.q[s_t].max())
            self.q[s, a] += self.rate * (target - self.q[s, a])

    def weights(self):
        return {"q": self.q.copy()}

    def policy(self, weights):
        return Greedy(weights["q"])

    def state(self) -> dict[str, Any]:
        return {"table": {"q": self.q}}

    def restore(self, state) -> None:
        self.q = state["table"]["q"].copy()


class Greedy:
    def __init__(self, q) -> None:
        self.q = q

    def act(self, observations):
        return self.q[observations.argmax(axis=1)].argmax(axis=1)


@pytest.mark.parametrize("agent", [PlainPQN, Table])
def test_an_agent_that_keeps_the_contract_passes(agent):
    check_agent(agent)


# --- one class for each way to break it ---


class OutOfRange(Table):
    def act(self, observations):
        return super().act(observations) + 1


class FloatActions(Table):
    def act(self, observations):
        return super().act(observations).astype(float)


class SharedWeights(Table):
    def weights(self):
        return {"q": self.q}


class NoWeights(Table):
    def weights(self):
        return {}


class PolicyOfTheBatch(Table):
    def policy(self, weights):
        greedy = Greedy(weights["q"])
        greedy.act = lambda observations: np.full(len(observations), int(len(observations) > 1))  # type: ignore
        return greedy


class PolicyOfTheAgent(Table):
    def policy(self, weights):
        del weights
        return Greedy(self.q.copy())


class UnseededActions(Table):
    def __init__(self, config, spaces, streams) -> None:
        super().__init__(config, spaces, streams)
        self.rng = np.random.default_rng()


class ForgetsItsTable(Table):
    def restore(self, state) -> None:
        pass


class ForgetsItsRate(Table):
    """Its step size falls, and a checkpoint does not hold where it is."""

    def observe(self, *args):
        super().observe(*args)
        self.rate *= 0.999


class NeverLearns(Table):
    def observe(self, *args):
        pass


@pytest.mark.parametrize(
    ("agent", "said"),
    [
        (OutOfRange, r"act: gave .*, must be from 0 to 1"),
        (FloatActions, "act: gave .*, must be as many integers"),
        (SharedWeights, "weights: changed while the agent continued to learn"),
        (NoWeights, "weights: must be a dictionary of NumPy arrays"),
        (PolicyOfTheBatch, "policy: an action must depend on its own observation alone"),
        (PolicyOfTheAgent, "policy: the same weights must give the same policy"),
        (UnseededActions, "two agents with the same seed differ"),
        (ForgetsItsTable, "restore: the weights differ"),
        (ForgetsItsRate, "restore: the resumed agent learns differently"),
        (NeverLearns, r"the greedy policy of the chain's states is \[0, 0, 0, 0, 0\]"),
    ],
)
def test_an_agent_that_breaks_the_contract_is_told_where(agent, said):
    with pytest.raises(AssertionError, match=said):
        check_agent(agent)


class NoPolicy:
    def __init__(self, config, spaces, streams) -> None: ...

    act = observe = weights = state = restore = lambda *_: None


@pytest.mark.parametrize(
    ("agent", "arguments", "said"),
    [
        (NoPolicy, {}, "must be an agent with policy; see touchdown.agents.agent.Agent"),
        (Table, {"options": {"rat": 1}}, "unexpected keyword argument 'rat'; it accepts rate"),
        (Table, {"options": {"rate": 2}}, "rate = 2: must be above 0 and at most 1"),
        ("no.such:Agent", {}, "module no.such cannot be imported: ModuleNotFoundError"),
        ("json:Agent", {}, "module json has no 'Agent'"),
        ("json:dumps", {}, "must be a class"),
        ("1:x", {}, "must be of the form package.module:Name"),
    ],
)
def test_what_is_no_agent_is_refused_in_one_line(agent, arguments, said):
    with pytest.raises(UserError, match=said) as refused:
        check_agent(agent, **arguments)
    assert "\n" not in str(refused.value)
