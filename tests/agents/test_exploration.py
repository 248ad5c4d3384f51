import pytest
from numpy.random import default_rng

from touchdown.agents import exploration
from touchdown.config import ExplorationConfig


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
        ("linear", 0.3),  # half of 8 observations; two episodes would give 0.4
        ("exponential", 0.125),  # ½·½²; four observations would give the floor
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
    episode, observations = 2, 4
    assert epsilon_of(episode, observations) == pytest.approx(expected)


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
def test_exploring_draws_one_number_for_each_world_whatever_epsilon_is(epsilon: float):
    rng, twin = default_rng(7), default_rng(7)
    exploration.explore(epsilon, 3, rng)
    for _ in range(3):
        twin.random()
    assert rng.bit_generator.state == twin.bit_generator.state
