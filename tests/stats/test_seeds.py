import math
import statistics

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from touchdown.stats import seeds
from touchdown.stats.seeds import mean_interval, summarise_seeds, tolerance_band


def test_the_mean_has_the_interval_of_the_textbook():
    # mean 2, sd 1, t(2) = 4.303: 2 ± 4.303 / √3
    interval = mean_interval([1, 2, 3])
    assert interval.value == 2
    assert_allclose([interval.low, interval.high], [2 - 2.4841, 2 + 2.4841], atol=1e-4)


def test_one_seed_is_an_interval_of_itself_and_has_no_band():
    summary = summarise_seeds([7.0])
    assert (summary.n, summary.mean.low, summary.mean.high, summary.band) == (1, 7, 7, None)
    assert summarise_seeds([7.0, 8.0]).band is None


def test_equal_seeds_have_intervals_of_no_width():
    summary = summarise_seeds([5.0] * 4)
    assert (summary.mean.low, summary.iqm.high, summary.band) == (5, 5, (5, 5))


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end():
    assert summarise_seeds([-1000, 2, 4, 9000]).iqm.value == 3


@pytest.mark.parametrize("values", [[], [1.0, math.nan], [math.inf], [[1.0], [2.0]]])
def test_values_that_are_not_a_list_of_numbers_are_refused(values):
    with pytest.raises(ValueError, match="values"):
        summarise_seeds(values)


def test_the_factor_of_the_band_is_that_of_published_tables():
    # Howe's k for 90% of a population with 95% confidence, n = 10: 2.84
    sample = np.random.default_rng(0).normal(size=10)
    low, high = tolerance_band(sample, content=0.9, confidence=0.95)
    assert_allclose((high - low) / 2 / statistics.stdev(sample), 2.84, rtol=0.01)


def test_the_band_contains_its_share_of_seeds_with_its_confidence():
    rng = np.random.default_rng(1)
    held = []
    for _ in range(1_000):
        low, high = tolerance_band(rng.normal(size=5))
        held.append(stats.norm.cdf(high) - stats.norm.cdf(low) >= seeds.BAND_CONTENT)
    assert abs(np.mean(held) - seeds.BAND_CONFIDENCE) < 0.04


@pytest.mark.parametrize("n", [3, 5, 10])
def test_the_interval_of_the_mean_covers_95_percent(n):
    rng = np.random.default_rng(n)
    intervals = [mean_interval(rng.normal(size=n)) for _ in range(2_000)]
    covered = np.mean([each.low <= 0 <= each.high for each in intervals])
    assert abs(covered - 0.95) < 0.015


@pytest.mark.parametrize(("n", "about"), [(3, 0.77), (5, 0.85), (10, 0.91)])
def test_the_bootstrap_of_few_seeds_covers_as_little_as_its_docstring_says(n, about):
    rng = np.random.default_rng(n)
    found = [summarise_seeds(rng.normal(size=n)).iqm for _ in range(150)]
    covered = np.mean([each.low <= 0 <= each.high for each in found])
    assert abs(covered - about) < 0.09
