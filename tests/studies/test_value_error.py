import math
from dataclasses import replace

import numpy as np
import pytest

from touchdown.agents.greedy import GreedyPolicy
from touchdown.config.presets import preset
from touchdown.core import records
from touchdown.core.errors import Interrupted, UserError
from touchdown.core.starts import TEST_STARTS
from touchdown.envs.recorder import record_flight
from touchdown.runs import folder as folders
from touchdown.runs.run import Run
from touchdown.studies import value_error
from touchdown.studies.value_error import read_overestimation


class Constant:
    """A network whose first action is always worth 5 and the others less."""

    def values_of_each(self, _params, observations):
        return np.tile([5.0, 1.0, 2.0, 3.0], (len(observations), 1))


@pytest.fixture
def run(tmp_path):
    config = preset("pilot")
    config = replace(config, training=replace(config.training, test_episodes=3))
    return Run(folders.create(tmp_path, config, "run"))


def test_what_is_recorded_is_the_first_value_and_the_discounted_return(run):
    policy = GreedyPolicy(Constant(), None)
    value_error.record(run, policy, lambda: False)
    config = run.config
    found = records.decode_json(run.path / "values.json", value_error._Values)
    assert found.gamma == config.learning.gamma
    starts = TEST_STARTS[: config.training.test_episodes][: value_error.NUM_STARTS]
    assert [each.seed for each in found.episodes] == list(starts)
    first = found.episodes[0]
    assert first.expected == pytest.approx(5.0 / config.learning.reward_scale)
    flight = record_flight(policy, config.env_id, first.seed, "x", drawn=False)
    slow = sum(r * found.gamma**t for t, r in enumerate(flight.rewards))
    assert first.discounted_return == pytest.approx(slow)
    errors = [each.expected - each.discounted_return for each in found.episodes]
    assert read_overestimation(run.path) == pytest.approx(np.mean(errors))


def test_a_stopped_record_is_not_written(run):
    with pytest.raises(Interrupted):
        value_error.record(run, GreedyPolicy(Constant(), None), lambda: True)
    assert math.isnan(read_overestimation(run.path))


def test_a_policy_without_a_network_has_no_record(run):
    class Still:
        def act(self, observations):
            return np.zeros(len(observations), int)

    value_error.record(run, Still(), lambda: False)
    assert math.isnan(read_overestimation(run.path))


def test_a_damaged_record_is_refused(run):
    (run.path / "values.json").write_text('{"format_version": 1, "gamma": 0.9, "episodes": []}')
    with pytest.raises(UserError, match="episodes"):
        read_overestimation(run.path)
