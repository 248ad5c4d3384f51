import os
import subprocess
import sys
from dataclasses import replace
from itertools import islice
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from stepping import fly
from touchdown.agents.learners import fused
from touchdown.agents.learners._fused import Perceptron, simd
from touchdown.agents.learners.fused import FusedNetwork
from touchdown.agents.learners.jax import (
    LearnerState,
    copy_target,
    init_learner,
    make_fit,
    make_update,
    state_from,
    tensors_of,
)
from touchdown.agents.networks import QNetwork
from touchdown.agents.registry import make_agent
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TrainingConfig,
)
from touchdown.core.errors import UserError
from touchdown.core.seeding import streams
from touchdown.core.types import Spaces
from touchdown.replay.transition import transition_dtype

D, A, K = 5, 3, 6
SPACES = Spaces(observation_size=5, num_actions=2)


def learning(**changes: Any) -> LearningConfig:
    settings = {
        "learning_rate": 1e-2,
        "learning_rate_end": 1e-3,
        "learning_rate_duration": 4,
        "reward_scale": 0.1,
        "target_period": 100,
    }
    return LearningConfig(**{**settings, **changes})


def batches(batch_size: int, seed: int = 0) -> np.ndarray:
    """Records of random transitions as words, [K, B, W]."""
    rng = np.random.default_rng(seed)
    count = K * batch_size
    records = np.zeros(count, transition_dtype(D))
    records["o_tm1"], records["o_t"] = rng.normal(size=(2, count, D))
    records["a_tm1"], records["a_t"] = rng.integers(A, size=(2, count))
    records["r_t"] = 20 * rng.normal(size=count)
    records["discount_t"] = rng.choice([0.0, 0.9], size=count)
    return records.view(np.float32).reshape(K, batch_size, -1)


def begin(network: QNetwork, config: LearningConfig) -> LearnerState:
    """A learner whose target network is another than its online one."""
    state = init_learner(network, config, 0)
    if state.target_params is None:
        return state
    return state._replace(target_params=init_learner(network, config, 1).online_params)


def assert_same_state(ours: LearnerState, twin: LearnerState) -> None:
    others = tensors_of(twin)
    assert tensors_of(ours).keys() == others.keys()
    for name, tensor in tensors_of(ours).items():
        assert_allclose(tensor, others[name], rtol=2e-3, atol=2e-5, err_msg=name)


NETWORKS = {
    "linear": NetworkConfig(hidden_sizes=()),
    "one layer": NetworkConfig(hidden_sizes=(7,)),
    "wider than a panel": NetworkConfig(hidden_sizes=(33, 17)),
    "normalised": NetworkConfig(hidden_sizes=(16, 8), layer_norm=True),
    "dueling": NetworkConfig(hidden_sizes=(16, 9), dueling=True),
    "dueling without a hidden layer": NetworkConfig(hidden_sizes=(), dueling=True),
    "normalised and dueling": NetworkConfig(hidden_sizes=(13,), layer_norm=True, dueling=True),
}
RULES = {
    "mse": learning(),
    "huber": learning(loss="huber"),
    "double": learning(double=True),
    "sarsa": learning(target="sarsa"),
    "without a target network": learning(target_period=0),
    "a target that follows": learning(target_period=0, polyak=0.1, double=True),
    "clipped": learning(max_grad_norm=0.05),
    "one step size": learning(learning_rate_duration=0),
}


@pytest.mark.parametrize("config", RULES.values(), ids=RULES)
@pytest.mark.parametrize("shape", NETWORKS.values(), ids=NETWORKS)
def test_updates_are_those_of_the_jax_function(shape, config):
    network, words = FusedNetwork(D, A, shape), batches(21)
    twin = state = begin(network, config)
    weights = np.random.default_rng(1).random((K, 21), np.float32)
    ours, metrics, td_error = fused.make_learn(network, config)(fused.own(state), words, weights)
    update = jax.jit(make_update(network, config), static_argnames="measured")
    for number in range(K):
        twin, expected, errors = update(twin, words[number], weights[number], measured=True)
        assert_allclose(td_error[number], errors, rtol=2e-3, atol=2e-5)
    assert_same_state(ours, twin)
    assert_allclose(metrics, expected, rtol=2e-3, atol=2e-5)


@pytest.mark.parametrize("batch_size", [1, 15, 16, 17, 64])
def test_any_size_of_a_minibatch_fills_its_panels(batch_size):
    config, network = learning(loss="huber"), FusedNetwork(D, A, NETWORKS["normalised"])
    state, words = begin(network, config), batches(batch_size)[:1]
    ours, metrics, _ = fused.make_learn(network, config)(fused.own(state), words, None)
    update = jax.jit(make_update(network, config), static_argnames="measured")
    twin, expected, _ = update(state, words[0], None, measured=True)
    assert_same_state(ours, twin)
    assert_allclose(metrics, expected, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("shape", NETWORKS.values(), ids=NETWORKS)
def test_fits_to_given_targets_are_those_of_the_jax_function(shape):
    config = learning(loss="huber", max_grad_norm=0.5, target_period=0)
    network, rng = FusedNetwork(D, A, shape), np.random.default_rng(2)
    state = init_learner(network, config, 0)
    o_tm1 = rng.normal(size=(40, D)).astype(np.float32)
    a_tm1, target = rng.integers(A, size=40, dtype=np.int32), rng.random(40, np.float32)
    order = np.stack([rng.permutation(40)[:18] for _ in range(K)])
    ours, metrics = fused.make_fit(network, config)(fused.own(state), o_tm1, a_tm1, target, order)
    fit = jax.jit(make_fit(network, config))
    twin = state
    for rows in order:
        twin, expected = fit(twin, o_tm1[rows], a_tm1[rows], target[rows])
    assert_same_state(ours, twin)
    assert_allclose(metrics, expected, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("shape", NETWORKS.values(), ids=NETWORKS)
def test_values_are_those_of_the_jax_function_whoever_is_beside(shape):
    network = FusedNetwork(D, A, shape)
    params = np.array(network.init(jax.random.key(3)))
    observations = np.random.default_rng(3).normal(size=(37, D)).astype(np.float32)
    q = network.values(params, observations)
    assert_allclose(q, network.apply(jnp.array(params), observations), atol=1e-5)
    alone = [network.values(params, row[None])[0] for row in observations]
    assert_array_equal(q, alone)


def test_one_step_of_adam_from_one_transition_can_be_checked_in_the_head():
    # Q(s,·) = (2s, 5s): of s = 1, Q(s,0) = 2; δ = 1 + ½·max(4, 10) − 2 = 4
    shape = NetworkConfig(hidden_sizes=())
    config = LearningConfig(learning_rate=0.25, target_period=100)
    network = FusedNetwork(1, 2, shape)
    params = jnp.array([2.0, 5.0, 0.0, 0.0])  # two weights, two biases
    state = init_learner(network, config, 0)
    state = fused.own(state._replace(online_params=params, target_params=params))
    record = np.zeros(1, transition_dtype(1))
    record["o_tm1"], record["r_t"], record["discount_t"], record["o_t"] = 1.0, 1.0, 0.5, 2.0
    words = record.view(np.float32).reshape(1, 1, -1)
    state, metrics, td_error = fused.make_learn(network, config)(state, words, None)
    assert td_error.tolist() == [[4.0]]
    assert metrics[:3] == (16.0, 3.5, 5.0)
    assert_allclose(metrics.gradient_norm, np.hypot(8.0, 8.0))  # −2δ for weight and bias
    # Adam's first step is the step size, whatever the gradient's length; the other action stays
    assert_allclose(state.online_params, [2.25, 5.0, 0.25, 0.0])
    assert_allclose(state.target_params, params)
    assert copy_target(state).target_params.tolist() == state.online_params.tolist()


def test_a_state_goes_through_tensors_and_learns_on_alike():
    config, network = learning(), FusedNetwork(D, A, NETWORKS["one layer"])
    learn, words = fused.make_learn(network, config), batches(8)
    state = learn(fused.own(begin(network, config)), words, None).state
    again = state_from(fused.own(begin(network, config)), tensors_of(state))
    went_on, restored = (tensors_of(learn(each, words, None).state) for each in (state, again))
    for name, tensor in went_on.items():
        assert_array_equal(restored[name], tensor)


AGENTS = {
    "dqn": Config(
        replay=ReplayConfig(capacity=100, min_size=8),
        learning=LearningConfig(batch_size=8, target_period=20, double=True, n_step=2),
    ),
    "pqn": Config(algorithm="pqn", rollout=RolloutConfig(rollout_steps=8, epochs=2, minibatches=2)),
}


@pytest.mark.parametrize("config", AGENTS.values(), ids=AGENTS)
def test_an_agent_learns_the_same_on_either_backend(chain, config):
    def learnt(backend: str) -> np.ndarray:
        settings = replace(
            config,
            network=NetworkConfig(hidden_sizes=(16,), layer_norm=True),
            exploration=ExplorationConfig(schedule="constant", epsilon_start=1.0),
            learning=replace(config.learning, backend=backend),
            training=TrainingConfig(num_envs=4),
        )
        agent = make_agent(settings, SPACES, streams(0))
        for _ in islice(fly(agent, *(chain(20) for _ in range(4))), 64):
            pass
        assert agent.updates > 10
        return agent.params()

    assert_allclose(learnt("fused"), learnt("jax"), rtol=1e-3, atol=1e-4)


def perceptron_call(**changes: Any) -> dict[str, Any]:
    size = Perceptron(D, [4], A).num_params
    arguments: dict[str, Any] = {
        name: np.zeros(size, np.float32) for name in ("online", "target", "mu", "nu")
    }
    arguments |= {
        "num_updates": 0,
        "rates": np.zeros(K, np.float32),
        "words": batches(8),
        "weights": None,
        "td_error": np.zeros((K, 8), np.float32),
        "huber": True,
        "double_q": False,
        "sarsa": False,
        "reward_scale": 1.0,
        "max_grad_norm": 0.0,
        "polyak": 0.0,
    }
    return arguments | changes


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"online": np.zeros(3, np.float32)}, "online has 3 entries, must have 39"),
        ({"rates": np.zeros(1, np.float32)}, "rates has 1 entries, must have 6"),
        ({"target": None, "double_q": True}, "target = None: must be given"),
        ({"words": np.full((K, 8, 15), 7, np.int32).view(np.float32)}, "action 7: must be from 0"),
        ({"words": batches(8)[:, :, :-1].copy()}, "a record has 14 entries, must have 15"),
        (
            {"td_error": np.zeros((K, 9), np.float32)},
            "a row of td_error has 9 entries, must have 8",
        ),
    ],
)
def test_arrays_that_do_not_fit_are_refused_before_anything_is_written(changes, said):
    arguments = perceptron_call(**changes)
    before = arguments["online"].copy()
    with pytest.raises(ValueError, match=said):
        Perceptron(D, [4], A).learn(**arguments)
    assert_array_equal(arguments["online"], before)


def test_indices_outside_of_the_samples_are_refused():
    size = Perceptron(D, [4], A).num_params
    flat = np.zeros((3, size), np.float32)
    with pytest.raises(ValueError, match="order: 9: must be from 0 to 8"):
        Perceptron(D, [4], A).fit(
            *flat,
            num_updates=0,
            rates=np.zeros(1, np.float32),
            o_tm1=np.zeros((9, D), np.float32),
            a_tm1=np.zeros(9, np.int32),
            targets=np.zeros(9, np.float32),
            order=np.array([[0, 9]]),
            td_error=np.zeros((1, 2), np.float32),
            huber=False,
            max_grad_norm=0.0,
        )


def test_a_machine_without_the_kernel_is_told_what_would_help(monkeypatch):
    monkeypatch.setattr(fused, "is_built", lambda: False)
    with pytest.raises(UserError, match=r"backend = 'fused': was not built.*backend = 'jax'"):
        FusedNetwork(D, A, NetworkConfig())


def test_every_instruction_set_that_runs_here_learns_the_same():
    program = (
        "import numpy as np\n"
        "from touchdown.agents.learners._fused import Perceptron, simd\n"
        "rng = np.random.default_rng(0)\n"
        "p = Perceptron(5, [33, 17], 3, layer_norm=True, dueling=True)\n"
        "o = rng.normal(size=(50, 5)).astype(np.float32)\n"
        "params = rng.normal(size=p.num_params).astype(np.float32)\n"
        "mu, nu = np.zeros((2, p.num_params), np.float32)\n"
        "order = rng.integers(50, size=(9, 20))\n"
        "p.fit(params, mu, nu, 0, np.full(9, 0.01, np.float32), o,\n"
        "      rng.integers(3, size=50, dtype=np.int32), rng.random(50, np.float32), order,\n"
        "      np.zeros((9, 20), np.float32), True, 0.5)\n"
        "print(simd(), *params.tolist())\n"
    )

    def learnt(name: str) -> list[str]:
        environment = {**os.environ, "TOUCHDOWN_SIMD": name}
        said = subprocess.run(
            [sys.executable, "-c", program],
            env=environment,
            capture_output=True,
            text=True,
            check=False,  # refused where the processor has no such instructions
        )
        return said.stdout.split()

    widest = learnt(simd())
    assert widest[0] == simd()
    for name in ("baseline", "avx2"):
        others = learnt(name)
        if not others:
            continue  # this processor does not have it
        assert others[0] == name
        assert_allclose(
            [float(p) for p in others[1:]], [float(p) for p in widest[1:]], rtol=2e-3, atol=2e-4
        )
    assert learnt("baseline")
