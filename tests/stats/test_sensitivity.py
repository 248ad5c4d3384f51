"""Sensitivity to settings, on scores whose answer is known."""

import numpy as np
import pytest

from touchdown.stats.sensitivity import normalised, sensitivity_of

SETTINGS = [["slow", 0.9], ["slow", 0.99], ["fast", 0.9], ["fast", 0.99]]


def test_an_algorithm_whose_settings_suit_all_environments_is_not_sensitive():
    scores = np.tile(np.array([0.1, 1.0, 0.3, 0.2])[None, :, None], (3, 1, 4))
    found = sensitivity_of(scores, SETTINGS)
    assert found.best == (1, 1, 1)
    assert found.best_shared == 1
    assert found.sensitivity == 0
    assert found.tuned.tolist() == pytest.approx([1.0] * 4)
    assert found.dimensionality == 0


def test_sensitivity_is_the_gain_of_settings_for_each_environment():
    # each environment wants another rate; a compromise has 0.6 in both
    by_environment = np.array([[1.0, 0.6, 0.0, 0.0], [0.0, 0.6, 1.0, 0.0]])
    found = sensitivity_of(np.repeat(by_environment[:, :, None], 3, axis=2), SETTINGS)
    assert found.best == (0, 2)
    assert found.best_shared == 1
    assert found.sensitivity == pytest.approx(0.4)
    # from ("slow", 0.99) to ("slow", 0.9) and ("fast", 0.9), both settings change
    assert found.dimensionality == 2


def test_one_setting_is_enough_if_the_other_stays_as_it_is():
    by_environment = np.array([[1.0, 0.0, 0.5, 0.0], [0.4, 0.0, 1.0, 0.0]])
    found = sensitivity_of(np.repeat(by_environment[:, :, None], 2, axis=2), SETTINGS)
    assert found.best == (0, 2)
    assert found.best_shared == 2
    assert found.dimensionality == 1


def test_scores_below_zero_need_no_tuning_if_one_choice_is_the_best_everywhere():
    scores = np.tile(np.array([-1.0, -0.1, -0.5, -2.0])[None, :, None], (2, 1, 3))
    assert sensitivity_of(scores, SETTINGS).dimensionality == 0


def test_the_best_of_many_noisy_settings_is_scored_with_other_seeds():
    # no setting is better than another, so that no choice gains anything
    rng = np.random.default_rng(0)
    found = [
        sensitivity_of(rng.normal(size=(4, 50, 3)), [[of] for of in range(50)]) for _ in range(200)
    ]
    assert np.mean([each.tuned.mean() for each in found]) == pytest.approx(0, abs=0.1)
    assert np.mean([each.sensitivity for each in found]) == pytest.approx(0, abs=0.1)


def test_each_environment_has_its_own_scale():
    rng = np.random.default_rng(1)
    scores = rng.normal(size=(2, 3, 4, 5))
    other = scores * np.array([1.0, 50.0, 3.0])[None, :, None, None] + 7.0
    np.testing.assert_allclose(normalised(other), normalised(scores))
    means = normalised(scores).mean(axis=3)
    for at, wanted in ((5, 0.0), (95, 1.0)):
        np.testing.assert_allclose(np.percentile(means, at, axis=(0, 2)), wanted, atol=1e-12)


def test_an_environment_whose_scores_are_all_the_same_has_zero():
    assert not normalised(np.full((2, 1, 3, 2), 5.0)).any()
