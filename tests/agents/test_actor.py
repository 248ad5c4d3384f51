import numpy as np
import pytest
from numpy.random import default_rng

from touchdown.agents.actor import Actor, periods_crossed
from touchdown.config.config import Config
from touchdown.config.sections import ExplorationConfig, TrainingConfig
from touchdown.core.types import StepResult


def new_actor(metrics_period: int = 6, **exploration) -> Actor:
    exploration = {"schedule": "constant", "epsilon_start": 0.0} | exploration
    config = Config(
        exploration=ExplorationConfig(**exploration),
        training=TrainingConfig(metrics_period=metrics_period),
    )
    return Actor(config, 2, default_rng(0))


def stepped(count: int, ended: int = 0) -> StepResult:
    """A step of `count` environments, in the first of which an episode ends."""
    over = np.arange(count) < ended
    return StepResult(np.zeros((count, 5)), np.zeros(count), over, np.zeros(count, bool))


def unasked() -> np.ndarray:
    raise AssertionError("the values are known already")


def test_a_period_is_crossed_as_often_as_a_multiple_of_it_is_reached():
    assert [periods_crossed(before, before + 4, 3) for before in (0, 4, 8, 12)] == [1, 1, 2, 1]
    assert periods_crossed(3, 5, 3) == 0  # the period at 3 was reached before


def test_known_values_choose_the_actions_until_they_are_forgotten():
    actor = new_actor()
    actor.next_q = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert actor.act(2, unasked).tolist() == [1, 0]
    actor.next_q = None
    assert actor.act(2, lambda: np.array([[5.0, 1.0], [0.0, 2.0]])).tolist() == [0, 1]


def test_metrics_are_due_when_updates_complete_a_period():
    actor, due = new_actor(metrics_period=6), []
    for _ in range(6):  # 4, 8, 12, 16, 20, 24
        before = actor.updates
        actor.updates += 4
        due.append(actor.metrics_due(before))
    assert due == [False, True, True, False, True, True]


def test_epsilon_follows_the_steps_that_are_counted():
    actor = new_actor(schedule="linear", epsilon_start=1.0, epsilon_end=0.0, epsilon_duration=8)
    assert [actor.observed(stepped(2)) for _ in range(3)] == [0, 2, 4]
    assert (actor.env_steps, actor.epsilon) == (6, 0.25)


@pytest.mark.parametrize("known", [None, np.array([[3.0, 4.0]])])
def test_a_restored_actor_knows_what_the_other_knew(known: np.ndarray | None):
    actor, restored = new_actor(epsilon_start=0.5), new_actor(epsilon_start=0.5)
    actor.observed(stepped(7, ended=2))
    actor.updates, actor.next_q = 5, known
    restored.restore(actor.state())
    counts = {"observations": 7, "episodes": 2, "updates": 5, "epsilon": 0.5}
    for each in (actor, restored):
        assert {name: of for name, of in each.state().items() if name != "acting"} == counts
    assert np.array_equal(restored.next_q, known) if known is not None else restored.next_q is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"observations": -1}, "agent.observations = -1: must be"),
        ({"episodes": 0.5}, "agent.episodes = 0.5: must be"),
        ({"epsilon": 2.0}, "agent.epsilon = 2.0: must be"),
    ],
)
def test_counts_that_no_actor_has_are_refused(changes: dict, said: str):
    actor = new_actor()
    with pytest.raises(ValueError, match=said):
        actor.restore(actor.state() | changes)
