"""What every learner keeps to, whatever computes it."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from touchdown.agents.learners.factory import make_learner
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.learners.jax import JaxLearner
from touchdown.agents.learners.learner import Learner
from touchdown.agents.rollout import Rollout
from touchdown.config.config import Config
from touchdown.config.sections import LearningConfig, NetworkConfig
from touchdown.core.types import Spaces
from touchdown.replay.transition import transition_dtype

D, K, B = 5, 3, 8
SPACES = Spaces(observation_size=D, num_actions=2)
SEEN = np.random.default_rng(1).normal(size=(4, D)).astype(np.float32)


@pytest.fixture(params=["jax", "fused"])
def backend(request: pytest.FixtureRequest) -> Any:
    return request.param


def new_learner(backend: Any, seed: int = 0, **network: Any) -> Learner:
    config = Config(
        seed=seed,
        network=NetworkConfig(**{"hidden_sizes": (16, 16)} | network),
        learning=LearningConfig(backend=backend, target_period=9, learning_rate=0.01),
    )
    return make_learner(config, SPACES)


def minibatches(seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    records = np.zeros(K * B, transition_dtype(D))
    records["o_tm1"], records["o_t"] = rng.normal(size=(2, K * B, D))
    records["a_tm1"] = rng.integers(2, size=K * B)
    records["r_t"], records["discount_t"] = rng.normal(size=K * B), 0.9
    return records.view(np.float32).reshape(K, B, -1)


def rollout() -> Rollout:
    rng = np.random.default_rng(2)
    o_tm1, o_t = rng.normal(size=(2, 6, 4, D)).astype(np.float32)
    r_t = rng.normal(size=(6, 4)).astype(np.float32)
    no = np.zeros((6, 4), np.float32)
    return Rollout(o_tm1, rng.integers(2, size=(6, 4), dtype=np.int32), r_t, o_t, no, no)


ORDER = np.arange(24).reshape(K, B)


def online(learner: Learner) -> np.ndarray:
    return np.array(learner.state.online_params)


def test_the_backend_of_the_config_picks_the_learner():
    assert isinstance(new_learner("jax"), JaxLearner)
    assert isinstance(new_learner("fused"), FusedLearner)


def test_an_update_gives_the_values_of_the_next_observations(backend):
    learner = new_learner(backend)
    before = online(learner)
    metrics, td_error, next_q = learner.update(minibatches(), None, SEEN, 0, measured=True)
    assert metrics is not None
    assert np.shape(td_error) == (K, B)
    assert not np.array_equal(online(learner), before)
    assert_allclose(next_q, learner.values(SEEN, 0), rtol=1e-4, atol=1e-5)


def test_a_fit_gives_the_values_of_the_next_observations_and_keeps_the_rollout(backend):
    learner, steps = new_learner(backend), rollout()
    before, kept = online(learner), [part.copy() for part in steps]
    metrics, next_q = learner.fit_rollout(steps, ORDER, SEEN)
    assert float(metrics.loss) > 0
    assert not np.array_equal(online(learner), before)
    assert_allclose(next_q, learner.values(SEEN, 0), rtol=1e-4, atol=1e-5)
    for part, copy in zip(steps, kept, strict=True):
        assert_array_equal(part, copy)


def test_metrics_are_given_only_where_they_are_asked_for(backend):
    learner = new_learner(backend)
    assert learner.update(minibatches(), None, SEEN, 0, measured=False).metrics is None


def test_only_copying_changes_the_target_network(backend):
    learner = new_learner(backend)
    held = np.array(learner.state.target_params)
    learner.update(minibatches(), None, SEEN, 0, measured=False)
    assert_array_equal(learner.state.target_params, held)
    learner.copy_target()
    assert_array_equal(learner.state.target_params, online(learner))
    learner.update(minibatches(1), None, SEEN, K, measured=False)
    assert not np.array_equal(learner.state.target_params, online(learner))


@pytest.mark.parametrize("noisy", [False, True])
def test_a_restored_learner_goes_on_identically(noisy: bool, backend):
    if noisy and backend == "fused":
        pytest.skip("the kernel has no noisy weights")
    learner, restored = (new_learner(backend, noisy=noisy) for _ in range(2))
    learner.update(minibatches(), None, SEEN, 0, measured=False)
    restored.restore(learner.tensors())
    results = [
        it.update(minibatches(1), None, SEEN, K, measured=True) for it in (learner, restored)
    ]
    for ours, theirs in zip(*results, strict=True):
        assert_array_equal(ours, theirs)
    for name, tensor in learner.tensors().items():
        assert_array_equal(restored.tensors()[name], tensor)


def test_tensors_of_another_network_are_refused(backend):
    learner, other = new_learner(backend), new_learner(backend, hidden_sizes=(8,))
    with pytest.raises(ValueError, match=r"online_params is float32\(.*must be float32"):
        learner.restore(other.tensors())


def test_noise_for_acting_is_drawn_anew_with_the_step_and_not_between():
    learner = new_learner("jax", noisy=True)
    one, same, other = (learner.values(SEEN, step) for step in (3, 3, 4))
    assert_array_equal(one, same)
    assert not np.isclose(one, other).all()


def test_one_seed_repeats_and_another_differs(backend):
    one, same, other = (new_learner(backend, seed) for seed in (3, 3, 4))
    assert_array_equal(online(one), online(same))
    assert not np.isin(online(one), online(other)).any()
