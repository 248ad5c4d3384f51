import numpy as np
import pytest
from numpy.random import default_rng

from touchdown.agents import exploration
from touchdown.config.sections import ExplorationConfig


def test_constant_never_changes():
    schedule = exploration.constant(0.3)
    assert [schedule(time) for time in (0, 1, 10**9)] == [0.3, 0.3, 0.3]


def test_linear_falls_in_a_line_and_stays_at_its_end():
    schedule = exploration.linear(start=1.0, end=0.5, duration=4)
    values = [schedule(time) for time in (0, 1, 2, 4, 5, 10**9)]
    assert values == [1.0, 0.875, 0.75, 0.5, 0.5, 0.5]


def test_exponential_falls_by_its_factor_down_to_its_floor():
    schedule = exploration.exponential(start=0.8, end=0.15, factor=0.5)
    values = [schedule(time) for time in (0, 1, 2, 3, 10**9)]
    assert values == pytest.approx([0.8, 0.4, 0.2, 0.15, 0.15])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("constant", 0.5),
        ("linear", 0.3),  # half of 8 env steps; two episodes would give 0.4
        ("exponential", 0.125),  # ½·½²; four env steps would give the floor
    ],
)
def test_each_schedule_goes_by_its_own_clock(name: str, expected: float):
    epsilon_of = exploration.make_schedule(
        ExplorationConfig(
            schedule=name,  # pyright: ignore[reportArgumentType]
            epsilon_start=0.5,
            epsilon_end=0.1,
            epsilon_decay=0.5,
            epsilon_duration=8,
        )
    )
    episode, env_steps = 2, 4
    assert epsilon_of(episode, env_steps) == pytest.approx(expected)


def test_the_papers_schedule_by_default_is_0975_an_episode_from_one():
    epsilon_of = exploration.make_schedule(ExplorationConfig())
    assert epsilon_of(0, 12_345) == 1.0
    assert epsilon_of(2, 12_345) == pytest.approx(0.950625)  # 0.975²
    assert epsilon_of(10_000, 0) == 0.01


def test_exploring_is_certain_at_one_and_never_happens_at_zero():
    rng = default_rng(0)
    assert exploration.explore(1.0, 1_000, rng).all()
    assert not exploration.explore(0.0, 1_000, rng).any()


def test_exploring_happens_as_often_as_epsilon_says():
    share = exploration.explore(0.3, 10_000, default_rng(0)).mean()
    assert share == pytest.approx(0.3, abs=0.014)  # three standard deviations


@pytest.mark.parametrize("epsilon", [0.0, 0.5, 1.0])
def test_exploring_draws_one_number_for_each_environment_whatever_epsilon_is(epsilon: float):
    rng, twin = default_rng(7), default_rng(7)
    exploration.explore(epsilon, 3, rng)
    for _ in range(3):
        twin.random()
    assert rng.bit_generator.state == twin.bit_generator.state


# --- actions in N environments ---


def greedy(epsilon: float, seed: int = 0, num_actions: int = 4) -> exploration.EpsilonGreedy:
    config = ExplorationConfig(schedule="constant", epsilon_start=epsilon)
    return exploration.EpsilonGreedy(config, num_actions, default_rng(seed))


def test_without_exploring_each_environment_gets_its_best_action_the_first_of_equals():
    q = np.array([[0.0, 3, 1, 2], [5, 5, 0, 5], [-4, -3, -2, -1]])
    assert greedy(0.0).act(3, lambda: q).tolist() == [1, 0, 3]


def test_values_are_not_asked_for_where_every_action_is_random():
    def values() -> np.ndarray:
        raise AssertionError("nobody needs them")

    actions = greedy(1.0).act(4_000, values)
    assert np.bincount(actions, minlength=4) == pytest.approx(1_000, abs=82)  # three deviations


def test_values_are_asked_for_once_where_some_action_is_greedy():
    asked: list[int] = []

    def values() -> np.ndarray:
        asked.append(1)
        return np.eye(4)[[2] * 1_000]

    actions = greedy(0.4).act(1_000, values)
    assert asked == [1]
    share = (actions == 2).mean()
    assert share == pytest.approx(0.6 + 0.4 / 4, abs=0.044)  # chance takes the best one too


def test_one_environment_draws_whether_to_explore_and_then_only_an_action_that_it_needs():
    chooser, twin = greedy(0.5, seed=3), default_rng(3)
    q = np.array([[0.0, 1.0, 0.0, 0.0]])
    expected = [int(twin.integers(4)) if twin.random() < 0.5 else 1 for _ in range(200)]
    assert [int(chooser.act(1, lambda: q)[0]) for _ in range(200)] == expected


@pytest.mark.parametrize(
    ("schedule", "after_env_steps", "after_episodes"),
    [("constant", 0.5, 0.5), ("linear", 0.3, 0.5), ("exponential", 0.5, 0.125)],
)
def test_epsilon_follows_env_steps_or_episodes_as_its_schedule_says(
    schedule, after_env_steps: float, after_episodes: float
):
    config = ExplorationConfig(
        schedule=schedule,
        epsilon_start=0.5,
        epsilon_end=0.1,
        epsilon_decay=0.5,
        epsilon_duration=8,
    )
    chooser = exploration.EpsilonGreedy(config, 2, default_rng(0))
    chooser.schedule(0, 4)
    assert chooser.epsilon == pytest.approx(after_env_steps)
    chooser.schedule(2, 0)
    assert chooser.epsilon == pytest.approx(after_episodes)
