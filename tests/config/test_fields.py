import dataclasses
from collections import Counter

import pytest

from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.fields import bare_names, with_settings
from touchdown.config.sections import SECTIONS, NetworkConfig
from touchdown.core.errors import UserError

PILOT = presets.preset("pilot")


def refusal(**settings) -> str:
    with pytest.raises(UserError) as refused:
        with_settings(PILOT, settings)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_a_bare_name_belongs_to_one_section_only():
    names = Counter(bare_names(Config))
    assert {name for name, count in names.items() if count > 1} == set()
    assert not set(names) & set(SECTIONS)


def test_settings_find_their_sections_by_name():
    config = with_settings(
        PILOT, {"learning_rate": 1e-3, "num_envs": 4, "hidden_sizes": [64, 32], "seed": 3}
    )
    assert config.learning == dataclasses.replace(PILOT.learning, learning_rate=1e-3)
    assert config.training == dataclasses.replace(PILOT.training, num_envs=4)
    assert config.network.hidden_sizes == (64, 32)
    assert config.seed == 3
    assert config.replay == PILOT.replay


def test_no_settings_leave_the_config_as_it_is():
    assert with_settings(PILOT, {}) == PILOT


def test_a_whole_section_is_replaced_before_its_fields():
    settings = {"activation": "tanh", "network": NetworkConfig(hidden_sizes=(8,))}
    config = with_settings(PILOT, settings)
    assert config.network == NetworkConfig(hidden_sizes=(8,), activation="tanh")


def test_settings_are_judged_together_and_not_one_by_one():
    # quantiles need Huber's loss, so neither of these two would do alone
    base = with_settings(PILOT, {"loss": "mse"})
    config = with_settings(base, {"network": NetworkConfig(quantiles=8), "loss": "huber"})
    assert (config.network.quantiles, config.learning.loss) == (8, "huber")


def test_a_former_name_is_still_understood():
    assert with_settings(PILOT, {"max_observations": 500}).training.max_env_steps == 500


def test_an_unknown_setting_is_answered_with_the_nearest_one():
    assert refusal(learning_rat=1e-3) == (
        "learning_rat: unknown setting; did you mean learning_rate?"
    )
    assert refusal(lr=1e-3) == "lr: unknown setting; did you mean learning_rate?"
    assert refusal(zzz=1) == "zzz: unknown setting; `touchdown train PRESET --help` lists them"


def test_a_preset_as_a_keyword_is_refused_instead_of_only_naming_the_settings():
    assert refusal(preset="swift") == (
        "preset: unknown setting; a preset is the first argument: touchdown.train('swift')"
    )


def test_a_refused_value_is_named_with_what_would_be_right():
    assert refusal(gamma=2) == "gamma = 2.0: must be from 0 to 1"
    assert refusal(network=3, activation="tanh") == "network = 3: must be a NetworkConfig"
    assert refusal(rollout_steps=5) == (
        "rollout_steps = 5: must stay 32 with algorithm = 'dqn', which does not use it"
    )
