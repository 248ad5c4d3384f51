from itertools import combinations

import numpy as np
import pytest

from touchdown.core.errors import UserError
from touchdown.core.seeding import check_seed, streams, training_start, tuning_starts
from touchdown.core.starts import TEST_STARTS, TRAINING_STARTS, VALIDATION_STARTS

RUNS = [(seed, episode) for seed in range(20) for episode in range(50)]


def test_test_validation_and_training_starts_never_overlap():
    for one, other in combinations([TEST_STARTS, VALIDATION_STARTS, TRAINING_STARTS], 2):
        assert max(one.start, other.start) >= min(one.stop, other.stop)
    assert all(len(starts) >= 100_000 for starts in (TEST_STARTS, VALIDATION_STARTS))


def test_every_start_is_a_seed_that_gymnasium_takes():
    assert TEST_STARTS.start >= 0
    assert TRAINING_STARTS.stop <= 2**31


def test_training_starts_come_only_from_their_range():
    assert all(training_start(*run) in TRAINING_STARTS for run in RUNS)
    assert all(start in TRAINING_STARTS for start in tuning_starts(0, 200))


def test_a_training_start_is_a_function_of_seed_and_episode():
    assert [training_start(*run) for run in RUNS] == [training_start(*run) for run in RUNS]


def test_training_starts_differ_between_episodes_and_between_seeds():
    # also between (1, 2) and (2, 1)
    assert len({training_start(*run) for run in RUNS}) == len(RUNS)


def test_training_starts_are_independent_of_the_streams():
    bounds = TRAINING_STARTS.start, TRAINING_STARTS.stop
    drawn = {int(stream.integers(*bounds)) for stream in streams(3)}
    assert not drawn & {training_start(3, episode) for episode in range(10)}


def test_training_starts_are_spread_over_their_range():
    starts = np.array([training_start(*run) for run in RUNS])
    middle = (TRAINING_STARTS.start + TRAINING_STARTS.stop) / 2
    assert 0.45 < (starts < middle).mean() < 0.55  # 1000 of them: sd 0.016


def test_tuning_starts_repeat_and_grow_at_the_end_and_differ_from_those_of_episodes():
    starts = tuning_starts(3, 10)
    assert tuning_starts(3, 20)[:10] == starts
    assert tuning_starts(4, 10) != starts
    assert not set(starts) & {training_start(*run) for run in RUNS}


def test_streams_of_one_seed_repeat_and_of_two_seeds_differ():
    one, same, other = streams(5), streams(5), streams(6)
    for stream, twin, stranger in zip(one, same, other, strict=True):
        numbers = stream.random(10)
        assert np.array_equal(numbers, twin.random(10))
        assert not np.isin(numbers, stranger.random(10)).any()


def test_drawing_from_one_stream_does_not_affect_another():
    one, same = streams(5), streams(5)
    one.exploration.random(1_000)
    assert np.array_equal(one.replay.random(10), same.replay.random(10))


def test_streams_of_one_seed_are_uncorrelated():
    one = streams(5)
    correlation = np.corrcoef([stream.random(10_000) for stream in one])
    assert correlation[0, 1] == pytest.approx(0, abs=0.03)  # three times 1/√10 000


@pytest.mark.parametrize(("seed", "count"), [(0, 1), (2**31 - 1, 1), (2**31 - 10, 10)])
def test_a_seed_is_accepted_if_all_that_follow_it_are_in_range(seed, count):
    check_seed(seed, count)


@pytest.mark.parametrize(("seed", "count"), [(-1, 1), (2**31, 1), (2**31 - 9, 10)])
def test_a_seed_out_of_range_is_refused_with_the_range(seed, count):
    with pytest.raises(UserError, match=f"seed = {seed}: must be from 0 to {2**31 - count}"):
        check_seed(seed, count)
