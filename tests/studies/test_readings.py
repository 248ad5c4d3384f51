import itertools

import pytest

from touchdown.studies import paper
from touchdown.studies.paper.readings import AXES, reading_studies, readings

READINGS = {reading.name: reading for reading in readings()}


def config_of(name: str, study: str, level: str):
    studies = reading_studies("full")[READINGS[name]]
    (found,) = (each for each in studies if each.name == f"{study}.{name}")
    (cell,) = (cell for cell in found.cells() if cell.name == level)
    return cell.config


def test_the_first_reading_is_the_papers_studies_with_the_same_runs():
    (first, studies), *_ = reading_studies("full").items()
    assert first.is_shipped
    shipped = paper.studies("full")
    for study in studies:
        original = shipped[study.name.partition(".")[0]]
        assert [r.digest for r in study.runs(2)] == [r.digest for r in original.runs(2)]


@pytest.mark.parametrize("pair", list(itertools.combinations(range(len(AXES)), 2)))
def test_every_pair_of_choices_occurs_equally_often(pair):
    combinations = list(itertools.product(*(list(AXES.values())[axis] for axis in pair)))
    pairs = [tuple(reading.choices[axis] for axis in pair) for reading in readings()]
    assert {pairs.count(each) for each in combinations} == {len(pairs) / len(combinations)}


def test_a_literal_reading_has_only_what_the_paper_says():
    config = config_of("literal-2.5e-4.ends.steps.above-0", "ladder", "preferential-dqn")
    learning = config.learning
    assert (learning.loss, learning.max_grad_norm, learning.reward_scale) == ("mse", 0.0, 1.0)
    assert (learning.learning_rate, learning.learning_rate_duration) == (2.5e-4, 0)
    assert not learning.bootstrap_on_time_limit
    assert config.exploration.epsilon_end == 0.01
    assert config.replay.resave_threshold == 0.0
    assert config.replay.resaves == 10
    assert config.training.max_env_steps == 250_000
    literal = READINGS["literal-2.5e-4.ends.steps.above-0"]
    assert literal.metric_of("best_return") == "last_return"
    assert literal.metric_of("share_solved") == "last_share_solved"
    assert literal.metric_of("area") == "area"


def test_training_by_episodes_ends_after_three_hundred():
    training = config_of("shipped.ends.episodes.above-99", "size", "3 × 30").training
    assert (training.episodes, training.max_env_steps) == (300, 300_000)


def test_the_positive_reward_is_varied_in_the_sections_that_are_about_it():
    name = "shipped.bootstraps.episodes.above-0"
    assert config_of(name, "resaves", "5").replay.resave_threshold == 0.0
    assert config_of(name, "discount", "0.9").replay.resave_threshold == 99.0
