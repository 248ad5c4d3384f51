from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from touchdown.core.errors import UserError
from touchdown.exports import agreement as agreements
from touchdown.policies.foreign.onnx_session import Session

OBSERVATIONS = np.zeros((3, 2), np.float32)
Q = np.array([[1.0, 2.0], [4.0, 3.0], [2.0, 2.0]])


class Policy:
    """Gives these values for any observation."""

    def __init__(self, q: np.ndarray) -> None:
        self.q = q

    def values(self, observations: np.ndarray) -> np.ndarray:
        return np.resize(self.q, (len(observations), self.q.shape[1]))

    def act(self, observations: np.ndarray) -> np.ndarray:
        return self.values(observations).argmax(axis=1)


class Model:
    """Gives these values and actions."""

    def __init__(self, q: np.ndarray, actions: list[int]) -> None:
        self.given = q, np.array(actions)

    def run(self, *_: Any) -> list[Any]:
        return list(self.given)


def check(q: np.ndarray, actions: list[int], policy: Policy | None = None, **options: float):
    model = cast(Session, Model(q, actions))
    return agreements.check(model, policy or Policy(Q), OBSERVATIONS, **options)


def test_a_model_with_the_same_values_and_actions_agrees():
    found = check(Q, [1, 0, 0])
    assert found.tolerance == pytest.approx(4e-5)  # 1e-5 of the largest value
    assert (found.observations, found.close, found.differing) == (3, 1, 0)
    assert str(found) == "3 of 3 actions agree with touchdown's"


def test_another_action_is_counted_where_the_two_best_are_equal():
    found = check(Q + 3e-5, [1, 0, 1])
    assert (found.close, found.differing) == (1, 1)
    assert str(found) == (
        "2 of 3 actions agree with touchdown's; in the rest, the two best values are equal up to "
        "rounding"
    )
    assert found.largest_difference == pytest.approx(3e-5)


def test_another_action_is_refused_where_the_two_best_differ():
    with pytest.raises(UserError, match=r"1 of 3 actions differ from touchdown's.*nothing is writ"):
        check(Q, [1, 1, 0])


def test_other_values_are_refused_though_the_actions_agree():
    with pytest.raises(UserError, match=r"0 of 3 actions differ.*values differ by up to 5e-05"):
        check(Q + 5e-5, [1, 0, 0])
    assert check(Q + 5e-5, [1, 0, 0], largest_term=10.0).tolerance == pytest.approx(1e-4)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(value):
    broken = np.where(Q == 4, value, Q)
    with pytest.raises(UserError, match="the policy's values are not finite"):
        check(broken, [1, 0, 0], Policy(broken))
    with pytest.raises(UserError, match=r"1 of 3 actions differ|values differ by up to"):
        check(broken, [1, 0, 0])


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> Callable[..., np.ndarray]:
    monkeypatch.setattr(agreements, "OBSERVATIONS", 3_000)

    def see(seed: int = 0, env_id: str = "LunarLander-v3", actions: int = 4) -> np.ndarray:
        return agreements.seen_in_flight(Policy(np.eye(actions)[:1]), env_id, seed)

    return see


def test_observations_come_from_many_starts_and_repeat(few):
    seen = few()
    assert seen.shape == (3_000, 8)
    assert seen.dtype == np.float32
    assert len(np.unique(seen[:16], axis=0)) == 16  # one start per environment
    assert seen[:, 1].min() < 0.5 < seen[:, 1].max()  # from the top and from near the ground
    assert_array_equal(few(), seen)
    assert not np.array_equal(few(1), seen)


def test_observations_of_other_environments_are_collected_too(few):
    assert few(env_id="CartPole-v1", actions=2).shape == (3_000, 4)
    lake = few(env_id="FrozenLake-v1")
    assert_array_equal(lake.sum(axis=1), np.ones(3_000))  # one-hot
