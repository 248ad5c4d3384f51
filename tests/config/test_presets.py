import re

import pytest

from touchdown.config.presets import DESCRIPTIONS, PRESETS, preset
from touchdown.core.errors import UserError


def test_paper_best_carries_the_values_that_section_9_prints():
    config = preset("paper-best")
    assert config.network.hidden_sizes == (100, 100, 100)
    assert config.replay.resaves == 10
    assert config.replay.resave_threshold == 99.0  # unstated; docs/deviations.md says why
    assert config.learning.target_period == 800
    assert config.learning.gamma == 0.99
    assert config.exploration.schedule == "exponential"
    assert config.exploration.epsilon_start == 1.0
    assert config.exploration.epsilon_decay == 0.975


def test_dqn_is_plain_replay_without_a_target_network():
    config = preset("dqn")
    assert config.learning.target_period == 0
    assert config.replay.resaves == 0
    assert config.learning.update_period == 1  # Algorithm 2 updates after every observation


def test_target_dqn_copies_every_1000_observations_and_is_dqn_otherwise():
    config = preset("target-dqn")
    assert config.learning.target_period == 1_000
    assert config.replay == preset("dqn").replay


def test_preferential_dqn_is_target_dqn_with_resaves():
    config, plain = preset("preferential-dqn"), preset("target-dqn")
    assert config.replay.resaves > 0
    assert config.learning == plain.learning
    assert config.exploration == plain.exploration
    assert config.network == plain.network


def test_every_preset_has_its_section_of_the_paper_and_its_own_label():
    assert DESCRIPTIONS.keys() == PRESETS.keys()
    cited = re.compile(r"section \d|\(.*\d{4}\)")  # of the paper, or another paper
    assert [name for name, text in DESCRIPTIONS.items() if not cited.search(text)] == []
    assert {name: config.preset for name, config in PRESETS.items()} == {
        name: name for name in PRESETS
    }


def test_presets_of_the_paper_and_the_field_fly_the_lander():
    elsewhere = {name for name, c in PRESETS.items() if c.env_id != "LunarLander-v3"}
    tables = {name for name in PRESETS if name.startswith("tabular-")} - {"tabular-lander"}
    assert elsewhere == tables | {"value-iteration", "cartpole", "acrobot", "mountain-car"}


def test_presets_are_different_settings_and_not_only_different_labels():
    assert len({config.digest for config in PRESETS.values()}) == len(PRESETS)


def test_an_unknown_preset_is_refused_with_the_nearest_one():
    with pytest.raises(UserError, match=r"preset 'paper': unknown; did you mean paper-best\?"):
        preset("paper")
    with pytest.raises(UserError, match="preset 'zz': unknown; `touchdown presets` lists them"):
        preset("zz")
