import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchdown.replay.n_step import NStep, Windows
from touchdown.replay.transition import Transition


def observation(time: int) -> np.ndarray:
    return np.array([time], np.float32)


def transitions_of(n: int, rewards: list[float], *, terminated: bool, gamma: float = 0.5) -> list:
    """The transitions of one episode with these rewards, as plain values."""
    steps, complete = NStep(n, gamma), []
    for time, reward in enumerate(rewards):
        ends = terminated and time == len(rewards) - 1
        complete += steps.push(
            observation(time), time, reward, observation(time + 1), terminated=ends
        )
    complete += steps.truncate()
    return [
        (int(e.o_tm1[0]), e.a_tm1, e.r_t, e.discount_t, int(e.o_t[0]), e.terminated)
        for e in complete
    ]


def test_three_steps_gather_their_rewards_and_bootstrap_where_they_end():
    complete = transitions_of(3, [1.0, 2.0, 4.0, 8.0], terminated=True)
    assert complete == [
        (0, 0, 1 + 2 / 2 + 4 / 4, 1 / 8, 3, False),
        (1, 1, 2 + 4 / 2 + 8 / 4, 0.0, 4, True),
        (2, 2, 4 + 8 / 2, 0.0, 4, True),
        (3, 3, 8.0, 0.0, 4, True),
    ]


def test_a_truncated_episode_still_bootstraps_from_its_last_observation():
    complete = transitions_of(3, [1.0, 2.0, 4.0, 8.0], terminated=False)
    assert complete[1:] == [
        (1, 1, 2 + 4 / 2 + 8 / 4, 1 / 8, 4, False),
        (2, 2, 4 + 8 / 2, 1 / 4, 4, False),
        (3, 3, 8.0, 1 / 2, 4, False),
    ]


@given(
    n=st.integers(1, 6),
    rewards=st.lists(st.floats(-10, 10), min_size=1, max_size=15),
    terminated=st.booleans(),
)
def test_every_step_begins_one_transition_whose_return_is_the_sum_written_out(
    n: int, rewards: list[float], terminated: bool
):
    complete = transitions_of(n, rewards, terminated=terminated, gamma=0.9)
    assert [row[0] for row in complete] == list(range(len(rewards)))
    for start, _, total, discount, end, ended in complete:
        assert end == min(start + n, len(rewards))
        assert total == pytest.approx(
            sum(0.9**k * reward for k, reward in enumerate(rewards[start:end]))
        )
        assert ended == (terminated and end == len(rewards))
        assert discount == pytest.approx(0 if ended else 0.9 ** (end - start))


def test_one_step_is_the_transition_itself():
    o_tm1, o_t = observation(1), observation(2)
    [complete] = NStep(1, 0.9).push(o_tm1, 3, 5.0, o_t, terminated=False)
    assert complete == Transition(o_tm1, 3, 5.0, 0.9, terminated=False, a_t=0, o_t=o_t)


def test_an_observation_that_its_owner_writes_over_while_it_waits_is_kept():
    steps, seen = NStep(2, 1.0), observation(1)
    assert steps.push(seen, 0, 0.0, seen, terminated=False) == []
    seen[:] = 99
    [complete] = steps.push(seen, 0, 0.0, observation(3), terminated=False)
    assert complete.o_tm1.tolist() == [1]


def test_no_steps_are_refused():
    with pytest.raises(ValueError, match="n must be at least 1"):
        NStep(0, 0.9)


# --- waiting for the next action ---


def waited(n: int, rewards: list[float], *, terminated: bool, after: int = 99) -> list:
    """As `transitions_of`, with the next action of each; step t takes action 10 + t."""
    steps, complete = NStep(n, 0.5, needs_next_action=True), []
    for time, reward in enumerate(rewards):
        ends = terminated and time == len(rewards) - 1
        complete += [
            (time, e)
            for e in steps.push(
                observation(time), 10 + time, reward, observation(time + 1), terminated=ends
            )
        ]
    complete += [(len(rewards), e) for e in steps.truncate(after)]
    return [
        (when, int(e.o_tm1[0]), e.a_tm1, e.r_t, e.discount_t, int(e.o_t[0]), e.terminated, e.a_t)
        for when, e in complete
    ]


def test_a_transition_that_waits_is_complete_when_the_next_action_is_known():
    assert waited(1, [1.0, 2.0, 4.0], terminated=True) == [
        (1, 0, 10, 1.0, 0.5, 1, False, 11),
        (2, 1, 11, 2.0, 0.5, 2, False, 12),
        (2, 2, 12, 4.0, 0.0, 3, True, 0),  # no action follows, and none is asked for
    ]


def test_the_last_transition_of_a_truncated_episode_gets_the_action_that_would_have_come():
    assert waited(1, [1.0, 2.0], terminated=False) == [
        (1, 0, 10, 1.0, 0.5, 1, False, 11),
        (2, 1, 11, 2.0, 0.5, 2, False, 99),
    ]


def test_three_steps_wait_for_the_action_after_the_last_of_them():
    complete = waited(3, [1.0, 2.0, 4.0, 8.0], terminated=False)
    assert complete == [
        (3, 0, 10, 1 + 2 / 2 + 4 / 4, 1 / 8, 3, False, 13),
        (4, 1, 11, 2 + 4 / 2 + 8 / 4, 1 / 8, 4, False, 99),
        (4, 2, 12, 4 + 8 / 2, 1 / 4, 4, False, 99),
        (4, 3, 13, 8.0, 1 / 2, 4, False, 99),
    ]
    ended = waited(3, [1.0, 2.0, 4.0, 8.0], terminated=True)
    assert ended[0] == (3, *complete[0][1:])
    assert [row[4:] for row in ended[1:]] == [(0.0, 4, True, 0)] * 3


@given(
    n=st.integers(1, 5),
    rewards=st.lists(st.floats(-10, 10), min_size=1, max_size=12),
    terminated=st.booleans(),
)
def test_waiting_changes_nothing_but_the_action_that_is_known(
    n: int, rewards: list[float], terminated: bool
):
    complete = waited(n, rewards, terminated=terminated)
    at_once = transitions_of(n, rewards, terminated=terminated)
    assert [(start, *rest) for _, start, _, *rest, _ in complete] == [
        (start, *rest) for start, _, *rest in at_once
    ]
    for _, start, action, _, _, end, ended, a_t in complete:
        assert action == 10 + start
        assert a_t == (0 if ended else 10 + end if end < len(rewards) else 99)


def test_unfinished_steps_go_to_arrays_and_back():
    steps = [NStep(3, 0.5) for _ in range(2)]
    for time in (4, 5):
        steps[1].push(observation(time), time, 10.0 + time, observation(time + 1), terminated=False)
    windows = Windows.empty(2, 3, 1)
    windows.a_tm1[0] = 9  # of steps that are over
    windows.read(steps)
    assert windows.lengths.tolist() == [0, 2]
    assert windows.a_tm1[1, :2].tolist() == [4, 5]
    others = [NStep(3, 0.5) for _ in range(2)]
    others[0].push(observation(1), 1, 1.0, observation(2), terminated=False)
    windows.write(others, np.array([[9], [6]], np.float32))
    assert others[0].tensors() == {}
    for name, array in steps[1].tensors().items():
        np.testing.assert_array_equal(others[1].tensors()[name], array)
