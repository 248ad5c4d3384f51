import json

import msgspec
import numpy as np
import pytest
import scipy
from numpy.random import default_rng

from touchdown.stats.summary import bootstrap_iqm, interquartile_mean, summarise


def summary_of(returns, steps=None, outcomes=None, fuel=None, threshold=200.0):
    count = len(returns)
    return summarise(
        returns,
        steps or [100] * count,
        outcomes or ["landed"] * count,
        fuel or [10.0] * count,
        threshold,
    )


# --- the interquartile mean ---


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([-9000, 3, 5, 700], 4),
        ([700, 5, -9000, 3], 4),  # in any order
        ([-9000, -800, 3, 4, 5, 8, 900, 70_000], 5),  # two at each end
        ([-9000, 1, 2, 9, 700], 4),  # a quarter of five is one
        ([1, 5], 3),  # a quarter of two is none
        ([7], 7),
    ],
)
def test_interquartile_mean_is_the_mean_of_the_middle_half(values: list[float], expected: float):
    assert interquartile_mean(values) == pytest.approx(expected)


def test_interquartile_mean_is_taken_along_an_axis():
    table = np.array([[-900, 3, 5, 700], [0, 1, 2, 900]])
    assert interquartile_mean(table).tolist() == [4, 1.5]
    assert interquartile_mean(table.T, axis=0).tolist() == [4, 1.5]


# --- its interval ---


def test_an_interval_covers_the_true_value_in_about_95_of_100_data_sets():
    rng, covered, count = default_rng(0), 0, 150
    for _ in range(count):
        interval = bootstrap_iqm((50 + 10 * rng.standard_normal(40)).tolist())
        covered += interval.low <= 50 <= interval.high  # a symmetric distribution's IQM
        assert interval.low <= interval.value <= interval.high
    assert 0.90 <= covered / count <= 0.98


def test_an_interval_narrows_with_the_root_of_the_number_of_values():
    rng = default_rng(0)

    def width(count: int) -> float:
        intervals = [bootstrap_iqm(rng.standard_normal(count).tolist()) for _ in range(10)]
        return float(np.mean([interval.high - interval.low for interval in intervals]))

    assert width(160) / width(10) == pytest.approx(1 / 4, rel=0.3)


def test_an_interval_repeats_with_its_seed_and_hardly_depends_on_it():
    values = default_rng(0).standard_normal(50).tolist()
    one, same, other = (bootstrap_iqm(values, seed) for seed in (1, 1, 2))
    assert one == same
    assert one != other
    assert one.low == pytest.approx(other.low, abs=0.05)
    assert one.value == other.value == interquartile_mean(values)


@pytest.mark.parametrize("count", [1, 2, 20])
def test_a_constant_sample_is_certain_of_its_value(count: int):
    interval = bootstrap_iqm([3.5] * count)
    assert (interval.value, interval.low, interval.high) == (3.5, 3.5, 3.5)


def test_an_interval_of_no_values_is_refused():
    with pytest.raises(ValueError, match="at least one value"):
        bootstrap_iqm([])


# --- the summary ---


def test_episodes_at_or_above_the_threshold_are_solved():
    assert summary_of([199.9, 200.0, 200.1, -200.0]).share_solved == 0.5
    assert summary_of([199.9, 200.0, 200.1, -200.0], threshold=-300.0).share_solved == 1.0


def test_worst_is_the_mean_of_the_lowest_twentieth():
    returns = [float(value) for value in range(100, 140)]
    returns[7], returns[30] = -50.0, -150.0
    assert summary_of(returns).worst_5_percent == -100.0  # two of forty


def test_worst_is_the_mean_of_at_least_one_episode():
    assert summary_of([5.0, -7.0, 9.0]).worst_5_percent == -7.0


def test_outcomes_are_shares_that_sum_to_one():
    outcomes = ["landed", "crashed", "landed", "timed out", "landed", "out of bounds", "landed"]
    outcomes.append("terminated")
    summary = summary_of([1.0] * 8, outcomes=outcomes)
    assert summary.outcomes == {
        "landed": 0.5,
        "crashed": 0.125,
        "out of bounds": 0.125,
        "timed out": 0.125,
        "terminated": 0.125,
    }
    assert sum(summary.outcomes.values()) == 1


def test_an_outcome_that_did_not_occur_has_no_share():
    assert summary_of([1.0, 2.0], outcomes=["crashed", "crashed"]).outcomes == {"crashed": 1.0}


def test_means_are_of_the_episodes():
    summary = summary_of([1.0, 2.0, 6.0], steps=[10, 20, 60], fuel=[0.3, 0.6, 3.0])
    assert summary.episodes == 3
    assert summary.mean_return == pytest.approx(3)
    assert summary.sd_return == pytest.approx(7**0.5)  # (4 + 1 + 9)/(3 − 1)
    assert summary.steps == pytest.approx(30)
    assert summary.fuel == pytest.approx(1.3)
    assert summary.threshold == 200


def test_the_interval_of_a_summary_is_that_of_its_returns():
    returns = default_rng(0).normal(200, 30, 30).tolist()
    assert summary_of(returns).iqm == bootstrap_iqm(returns)


def test_one_episode_has_no_spread():
    summary = summary_of([123.0])
    assert (summary.mean_return, summary.sd_return, summary.worst_5_percent) == (123.0, 0.0, 123.0)
    assert summary.iqm == bootstrap_iqm([123.0])


def test_a_summary_of_no_episodes_is_refused():
    with pytest.raises(ValueError, match="at least one"):
        summary_of([])


def test_a_summary_is_json_with_every_number():
    summary = summary_of([1.0, 2.0, 4.0, 8.0])
    row = json.loads(json.dumps(summary.to_json(), allow_nan=False))
    assert row.keys() == {item.encode_name for item in msgspec.structs.fields(summary)}
    assert row["iqm"]["value"] == 3.0


@pytest.mark.parametrize("count", [2, 3, 4, 5, 100, 1_000])
def test_the_interquartile_mean_and_its_interval_are_scipys(count: int):
    values = 200 + 80 * default_rng(count).standard_normal(count)
    assert interquartile_mean(values) == scipy.stats.trim_mean(values, 0.25)
    twin = scipy.stats.bootstrap(
        (values,),
        lambda sample, axis: scipy.stats.trim_mean(sample, 0.25, axis=axis),
        n_resamples=2_000,
        method="percentile",
        rng=default_rng(3),
    ).confidence_interval
    found = bootstrap_iqm(values.tolist(), seed=3)
    assert (found.low, found.high) == pytest.approx((twin.low, twin.high), rel=1e-14)
