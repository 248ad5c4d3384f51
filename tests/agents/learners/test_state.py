import numpy as np

from touchdown.agents.learners.state import init_state
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import LearningConfig


def test_without_a_period_there_is_no_target_network(network: QNetwork):
    assert init_state(network, LearningConfig(), seed=0).target_params is None


def test_fresh_states_repeat_with_their_seed_and_differ_between_seeds(network: QNetwork):
    def params(seed: int) -> np.ndarray:
        return np.asarray(init_state(network, LearningConfig(), seed).online_params)

    assert np.array_equal(params(3), params(3))
    assert not np.array_equal(params(3), params(4))
