from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy import stats

from touchdown.replay.priorities import Proportional
from touchdown.replay.replay import Replay
from touchdown.replay.transition import Transition


def observation(time: float) -> np.ndarray:
    return np.array([time, -time], np.float32)


def add(memory: Replay, time: int, reward: float = 0.0, *, terminated: bool = False) -> None:
    discount = 0.0 if terminated else 0.5
    before, after = observation(time), observation(time + 1)
    memory.add(Transition(before, time % 4, reward, discount, terminated, 0, after))


def times(records: np.ndarray) -> list[int]:
    return records["o_tm1"][:, 0].astype(int).tolist()


@given(
    capacity=st.integers(1, 12),
    resaves=st.integers(0, 4),
    threshold=st.sampled_from([-1.0, 0.0, 2.0]),
    rewards=st.lists(st.sampled_from([-2.0, -1.0, 0.0, 1.0, 2.0, 3.0]), max_size=30),
)
def test_replay_keeps_what_a_bounded_deque_of_copies_keeps(
    capacity: int, resaves: int, threshold: float, rewards: list[float]
):
    memory = Replay(capacity, 2, resaves, threshold)
    twin: deque[tuple[int, float]] = deque(maxlen=capacity)
    for time, reward in enumerate(rewards):
        add(memory, time, reward)
        twin.append((time, reward))
        if reward > threshold:
            twin.extend([(time, reward)] * resaves)
        records = memory.ring.records
        assert sorted(zip(times(records), records["r_t"].tolist(), strict=True)) == list(twin)
        assert len(memory) == len(twin)
    assert memory.shares().rewarded == pytest.approx(
        np.mean([reward > threshold for _, reward in twin]) if twin else 0.0
    )


@pytest.mark.parametrize("resaves", [0, 1, 10])
def test_a_rewarded_transition_is_stored_once_and_tau_times_more(resaves: int):
    memory = Replay(100, 2, resaves, resave_threshold=1.5)
    add(memory, time=1, reward=1.5)  # at the threshold exactly: not rewarded
    assert len(memory) == 1
    add(memory, time=2, reward=1.6)
    assert times(memory.ring.records) == [1] + [2] * (resaves + 1)


def test_a_transition_is_stored_field_by_field():
    memory = Replay(4, 2, resaves=1)
    before, after = np.array([1, 2], np.float32), np.array([6, 7], np.float32)
    memory.add(Transition(before, 3, 4.5, 0.0, terminated=True, a_t=0, o_t=after))
    assert len(memory) == 2
    for record in memory.ring.records:
        assert record["o_tm1"].tolist() == [1, 2]
        assert record["a_tm1"] == 3
        assert record["r_t"] == 4.5
        assert record["discount_t"] == 0
        assert record["terminated"] == 1
        assert record["o_t"].tolist() == [6, 7]


def test_memory_keeps_an_observation_that_its_owner_writes_over():
    memory, seen = Replay(4, 2), observation(3)
    memory.add(Transition(seen, 0, 0.0, 0.5, terminated=False, a_t=0, o_t=seen))
    seen[:] = 99
    assert memory.ring.records["o_tm1"].tolist() == memory.ring.records["o_t"].tolist() == [[3, -3]]


def test_every_transition_held_is_drawn_equally_often():
    memory, rng = Replay(10, 2), default_rng(0)
    for time in range(25):  # the last ten are held
        add(memory, time)
    drawn = np.concatenate([times(memory.sample(50, rng).records) for _ in range(200)])
    values, counts = np.unique(drawn, return_counts=True)
    assert values.tolist() == list(range(15, 25))
    assert stats.chisquare(counts).pvalue > 0.01


def test_only_transitions_held_are_drawn_while_the_memory_fills():
    memory, rng = Replay(1_000, 2), default_rng(0)
    for time in range(1, 4):
        add(memory, time)
    assert set(times(memory.sample(500, rng).records)) == {1, 2, 3}


def test_a_resaved_transition_is_drawn_in_proportion_to_its_copies():
    memory = Replay(100, 2, resaves=3)
    add(memory, 0, reward=-1)
    add(memory, 1, reward=1)
    drawn = times(memory.sample(5_000, default_rng(0)).records)
    assert np.mean(drawn) == pytest.approx(4 / 5, abs=0.02)  # four copies to one


def test_draws_repeat_with_the_generator_and_differ_between_generators():
    memory = Replay(100, 2)
    for time in range(100):
        add(memory, time)
    one, same, other = (times(memory.sample(64, default_rng(seed)).records) for seed in (1, 1, 2))
    assert one == same
    assert one != other


def test_a_batch_stays_as_it_was_drawn_when_the_memory_goes_on():
    memory = Replay(2, 2)
    add(memory, 1)
    batch = memory.sample(3, default_rng(0)).records
    add(memory, 5)
    add(memory, 6)
    add(memory, 7)
    assert times(batch) == [1, 1, 1]


def test_an_empty_memory_cannot_be_sampled_and_has_no_shares():
    memory = Replay(4, 2)
    with pytest.raises(ValueError, match="high"):
        memory.sample(1, default_rng(0))
    assert memory.shares() == (0.0, 0.0)


def test_shares_count_the_copies_that_are_held():
    memory = Replay(8, 2, resaves=2)
    add(memory, 0, reward=-1, terminated=True)
    add(memory, 1, reward=0)
    assert memory.shares() == (0.0, 0.5)
    add(memory, 2, reward=1)  # three copies
    assert memory.shares() == (3 / 5, 1 / 5)
    add(memory, 3, reward=1, terminated=True)  # three more
    assert memory.shares() == (6 / 8, 4 / 8)
    add(memory, 4, reward=0)  # overwrites the first, which was terminal
    assert memory.shares() == (6 / 8, 3 / 8)


def test_terminal_share_counts_terminations_and_not_zero_discounts():
    memory = Replay(8, 2)
    discount_t = 0.0  # γ = 0
    memory.add(
        Transition(observation(0), 0, 0.0, discount_t, terminated=False, a_t=0, o_t=observation(1))
    )
    assert memory.shares().terminal == 0.0


def test_a_restored_memory_draws_the_same_transitions():
    memory, restored = Replay(7, 2, resaves=2), Replay(7, 2, resaves=2)
    for time in range(20):
        add(memory, time, reward=time % 3 - 1)
    restored.restore(memory.tensors(), memory.ring.added)
    for time in range(20, 25):
        add(memory, time, reward=1)
        add(restored, time, reward=1)
        ours, theirs = (m.sample(32, default_rng(time)).records for m in (memory, restored))
        assert np.array_equal(ours, theirs)


# --- drawn by priority ---


def prioritized(capacity: int = 8, **changes: float) -> Replay:
    settings = {"alpha": 1.0, "beta": 1.0, "beta_duration": 10} | changes
    return Replay(capacity, 2, priorities=Proportional(**settings))


def test_transitions_are_drawn_in_proportion_to_their_last_error():
    memory, rng = prioritized(), default_rng(0)
    for time in range(4):
        add(memory, time)
    memory.update_priorities(
        np.arange(4), np.array([1.0, -2.0, 0.0, 5.0])
    )  # its sign does not matter
    drawn = np.concatenate([times(memory.sample(80, rng).records) for _ in range(100)])
    shares = np.bincount(drawn, minlength=4) / len(drawn)
    assert shares == pytest.approx([1 / 8, 2 / 8, 0, 5 / 8], abs=0.01)


def test_alpha_flattens_the_priorities():
    memory, rng = prioritized(alpha=0.5), default_rng(0)
    for time in range(2):
        add(memory, time)
    memory.update_priorities(np.arange(2), np.array([1.0, 9.0]))
    drawn = np.concatenate([times(memory.sample(80, rng).records) for _ in range(100)])
    assert np.mean(drawn) == pytest.approx(3 / 4, abs=0.01)  # √9 of √1 + √9


def test_importance_weights_make_up_for_the_priorities():
    memory = prioritized()
    for time in range(2):
        add(memory, time)
    memory.update_priorities(np.arange(2), np.array([1.0, 3.0]))
    sample = memory.sample(64, default_rng(0))
    weight = {time: sample.weights[i] for i, time in enumerate(times(sample.records))}
    assert weight[0] == 1.0  # the largest
    assert weight[1] == pytest.approx(1 / 3, rel=1e-4)  # three times as often, a third as much


def test_beta_rises_to_one_over_its_duration():
    memory = prioritized(beta=0.0)
    for time in range(2):
        add(memory, time)
    memory.update_priorities(np.arange(2), np.array([1.0, 4.0]))
    least = [float(memory.sample(64, default_rng(0)).weights.min()) for _ in range(13)]
    assert least[0] == 1.0
    assert least[5] == pytest.approx(4**-0.5, rel=1e-3)
    assert least[10:] == pytest.approx([1 / 4] * 3, rel=1e-3)


def test_what_was_not_drawn_yet_has_the_largest_priority_met_so_far():
    memory = prioritized()
    add(memory, 0)
    memory.update_priorities(np.array([0]), np.array([7.0]))
    memory.update_priorities(np.array([0]), np.array([1.0]))
    add(memory, 1)
    drawn = np.concatenate([times(memory.sample(80, default_rng(i)).records) for i in range(50)])
    assert np.mean(drawn) == pytest.approx(7 / 8, abs=0.01)


def test_a_new_transition_does_not_inherit_the_priority_of_the_one_it_overwrites():
    memory = prioritized(capacity=2)
    for time in range(2):
        add(memory, time)
    memory.update_priorities(np.arange(2), np.array([0.5, 0.5]))
    add(memory, 2)  # in the place of the first
    drawn = np.concatenate([times(memory.sample(80, default_rng(i)).records) for i in range(50)])
    assert set(drawn) == {1, 2}
    assert np.mean(drawn == 2) == pytest.approx(1 / 1.5, abs=0.01)


def test_a_restored_prioritized_memory_draws_the_same():
    memory, restored = prioritized(beta=0.2), prioritized(beta=0.2)
    for time in range(20):
        add(memory, time)
    memory.update_priorities(np.arange(8), np.arange(8.0))
    memory.sample(4, default_rng(0))
    restored.restore(memory.tensors(), memory.ring.added)
    for seed in range(3):
        ours, theirs = (m.sample(32, default_rng(seed)) for m in (memory, restored))
        assert np.array_equal(ours.records, theirs.records)
        assert np.array_equal(ours.weights, theirs.weights)


def test_an_empty_prioritized_memory_cannot_be_sampled():
    with pytest.raises(ValueError, match="empty"):
        prioritized().sample(1, default_rng(0))
