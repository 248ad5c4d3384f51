import os
import platform
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
from touchdown.agents.initial import initial_params
from touchdown.agents.learners import _fused, fused_network
from touchdown.agents.learners._fused import Perceptron, simd
from touchdown.agents.learners.factory import make_learner
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.learners.fused_network import FusedNetwork
from touchdown.agents.learners.jax import JaxLearner
from touchdown.agents.learners.state import LearnerState, init_state, state_from, tensors_of
from touchdown.agents.learners.update import make_fit, make_update
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
from touchdown.replay.transition import field_offsets, transition_dtype

D, A, K = 5, 3, 6
SPACES = Spaces(observation_size=5, num_actions=2)
SEEN = np.random.default_rng(9).normal(size=(7, D)).astype(np.float32)


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
    """Random packed transitions, [K, B, W]."""
    rng = np.random.default_rng(seed)
    count = K * batch_size
    records = np.zeros(count, transition_dtype(D))
    records["o_tm1"], records["o_t"] = rng.normal(size=(2, count, D))
    records["a_tm1"], records["a_t"] = rng.integers(A, size=(2, count))
    records["r_t"] = 20 * rng.normal(size=count)
    records["discount_t"] = rng.choice([0.0, 0.9], size=count)
    return records.view(np.float32).reshape(K, batch_size, -1)


def new_learner(shape: NetworkConfig, config: LearningConfig) -> FusedLearner:
    """A learner whose target network differs from its online one, where it has one."""
    learner = FusedLearner(FusedNetwork(D, A, shape), Config(network=shape, learning=config))
    if learner.state.target_params is not None:
        other = initial_params(learner.model.layout, 1)
        learner.state = learner.state._replace(target_params=other)
    return learner


def twin_of(learner: FusedLearner, config: LearningConfig) -> tuple[QNetwork, LearnerState]:
    """The same network, and a copy of the state, as JAX's functions take them."""
    network = QNetwork(D, A, learner.model.config)
    return network, state_from(init_state(network, config, 0), learner.tensors())


def assert_same_state(ours: FusedLearner, twin: LearnerState) -> None:
    others = tensors_of(twin)
    assert ours.tensors().keys() == others.keys()
    for name, tensor in ours.tensors().items():
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
    "soft updates": learning(target_period=0, polyak=0.1, double=True),
    "clipped": learning(max_grad_norm=0.05),
    "one step size": learning(learning_rate_duration=0),
}


DISTRIBUTIONS = {
    "quantiles": NetworkConfig(hidden_sizes=(16, 9), quantiles=8),
    "one quantile": NetworkConfig(hidden_sizes=(7,), quantiles=1),
    "dueling quantiles": NetworkConfig(hidden_sizes=(13,), quantiles=5, dueling=True),
    "atoms": NetworkConfig(hidden_sizes=(16, 9), atoms=11),
    "many atoms": NetworkConfig(hidden_sizes=(), atoms=51, v_min=-3.0, v_max=5.0),
    "normalised and dueling atoms": NetworkConfig(
        hidden_sizes=(13,), layer_norm=True, dueling=True, atoms=7, v_min=0.0, v_max=1.0
    ),
}
CASES = [
    *(
        pytest.param(shape, config, id=f"{network}-{rule}")
        for network, shape in NETWORKS.items()
        for rule, config in RULES.items()
    ),
    *(
        pytest.param(shape, replace(config, loss="huber"), id=f"{network}-{rule}")
        for network, shape in DISTRIBUTIONS.items()
        for rule, config in RULES.items()
        if rule == "huber" or (shape.dueling and rule not in {"mse", "one step size"})
    ),
]


@pytest.mark.parametrize(("shape", "config"), CASES)
def test_updates_are_those_of_the_jax_function(shape, config):
    learner, packed = new_learner(shape, config), batches(21)
    network, twin = twin_of(learner, config)
    weights = np.random.default_rng(1).random((K, 21), np.float32)
    metrics, td_error, next_q = learner.update(packed, weights, SEEN, 0, measured=True)
    update = jax.jit(make_update(network, config), static_argnames="measured")
    for number in range(K):
        twin, expected, errors = update(twin, packed[number], weights[number], measured=True)
        assert_allclose(td_error[number], errors, rtol=2e-3, atol=2e-5)
    assert_same_state(learner, twin)
    assert_allclose(metrics, expected, rtol=2e-3, atol=2e-5)
    assert_allclose(next_q, network.apply(twin.online_params, SEEN), rtol=2e-3, atol=2e-3)


@pytest.mark.parametrize("batch_size", [1, 15, 16, 17, 64])
def test_any_size_of_a_minibatch_fills_its_panels(batch_size):
    config, shape = learning(loss="huber"), NETWORKS["normalised"]
    learner, packed = new_learner(shape, config), batches(batch_size)[:1]
    network, before = twin_of(learner, config)
    metrics, _, _ = learner.update(packed, None, SEEN, 0, measured=True)
    update = jax.jit(make_update(network, config), static_argnames="measured")
    twin, expected, _ = update(before, packed[0], None, measured=True)
    assert_same_state(learner, twin)
    assert_allclose(metrics, expected, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("shape", NETWORKS.values(), ids=NETWORKS)
def test_fits_to_given_targets_are_those_of_the_jax_function(shape):
    config = learning(loss="huber", max_grad_norm=0.5, target_period=0)
    learner, rng = new_learner(shape, config), np.random.default_rng(2)
    network, twin = twin_of(learner, config)
    o_tm1 = rng.normal(size=(40, D)).astype(np.float32)
    a_tm1, target = rng.integers(A, size=40, dtype=np.int32), rng.random(40, np.float32)
    order = np.stack([rng.permutation(40)[:18] for _ in range(K)])
    metrics = learner.fit(o_tm1, a_tm1, target, order)
    fit = jax.jit(make_fit(network, config))
    for rows in order:
        twin, expected = fit(twin, o_tm1[rows], a_tm1[rows], target[rows])
    assert_same_state(learner, twin)
    assert_allclose(metrics, expected, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("shape", (NETWORKS | DISTRIBUTIONS).values(), ids=NETWORKS | DISTRIBUTIONS)
def test_values_are_those_of_the_jax_function_whatever_the_batch(shape):
    twin = QNetwork(D, A, shape)
    network = FusedNetwork(D, A, shape)
    params = initial_params(network.layout, 3)
    observations = np.random.default_rng(3).normal(size=(37, D)).astype(np.float32)
    q = network.values_of_each(params, observations)
    assert_allclose(q, twin.apply(jnp.array(params), observations), atol=1e-5)
    alone = [network.values_of_each(params, row[None])[0] for row in observations]
    assert_array_equal(q, alone)


def test_one_step_of_adam_from_one_transition_can_be_checked_in_the_head():
    # Q(s,·) = (2s, 5s): of s = 1, Q(s,0) = 2; δ = 1 + ½·max(4, 10) − 2 = 4
    shape = NetworkConfig(hidden_sizes=())
    config = LearningConfig(learning_rate=0.25, target_period=100)
    learner = FusedLearner(FusedNetwork(1, 2, shape), Config(network=shape, learning=config))
    params = np.array([2.0, 5.0, 0.0, 0.0], np.float32)  # two weights, two biases
    learner.state = learner.state._replace(online_params=params.copy(), target_params=params)
    record = np.zeros(1, transition_dtype(1))
    record["o_tm1"], record["r_t"], record["discount_t"], record["o_t"] = 1.0, 1.0, 0.5, 2.0
    packed = record.view(np.float32).reshape(1, 1, -1)
    metrics, td_error, next_q = learner.update(
        packed, None, np.ones((1, 1), np.float32), 0, measured=True
    )
    assert td_error.tolist() == [[4.0]]
    assert metrics[:3] == (16.0, 3.5, 5.0)
    assert_allclose(metrics.gradient_norm, np.hypot(8.0, 8.0))  # −2δ for weight and bias
    # Adam's first step is the step size, whatever the gradient's length; the other action stays
    assert_allclose(learner.state.online_params, [2.25, 5.0, 0.25, 0.0])
    assert_allclose(next_q, [[2.5, 5.0]])  # of s = 1 after the update
    assert_allclose(learner.state.target_params, params)
    learner.copy_target()
    assert learner.state.target_params.tolist() == learner.state.online_params.tolist()


@pytest.mark.skipif(
    platform.machine().lower() not in {"x86_64", "amd64", "arm64", "aarch64"},
    reason="other processors keep their denormal numbers",
)
def test_moments_of_weights_without_a_gradient_become_zeros_and_never_denormal():
    # with denormal numbers, each update would take twice as long
    shape = NetworkConfig(hidden_sizes=())
    learner = FusedLearner(FusedNetwork(1, 2, shape), Config(network=shape))
    smallest = np.finfo(np.float32).tiny
    learner.state.mu[:] = 1.05 * smallest
    record = np.zeros(1, transition_dtype(1))
    record["o_tm1"], record["r_t"] = 1.0, 1.0
    packed = record.view(np.float32).reshape(1, 1, -1)
    learner.update(packed, None, np.ones((1, 1), np.float32), 0, measured=False)
    mu = learner.state.mu
    assert mu[0] != 0  # of the action taken
    assert mu[1] == 0  # 0.9 · 1.05 of the smallest normal number
    assert np.float32(smallest) / np.float32(2) > 0  # here, they are kept


def test_a_state_goes_through_tensors_and_learns_on_alike():
    learner, restored = (new_learner(NETWORKS["one layer"], learning()) for _ in range(2))
    learner.update(batches(8), None, SEEN, 0, measured=False)
    restored.restore(learner.tensors())
    for each in (learner, restored):
        each.update(batches(8), None, SEEN, K, measured=False)
    for name, tensor in learner.tensors().items():
        assert_array_equal(restored.tensors()[name], tensor)


def test_a_policy_is_computed_by_the_kernel_and_described_as_the_same_network_in_jax():
    shape = NETWORKS["normalised"]
    model, twin = FusedNetwork(D, A, shape), QNetwork(D, A, shape)
    params = initial_params(model.layout, 0)
    assert_array_equal(model.policy(params).values(SEEN), model.values_of_each(params, SEEN))
    assert_allclose(model.policy(params).values(SEEN), twin.policy(params).values(SEEN), atol=1e-5)
    assert model.describe() == twin.describe()
    layers = {name: np.asarray(values) for name, values in model.layers(params).items()}
    assert_array_equal(model.params_of(layers), params)


def test_a_checkpoint_of_one_backend_is_read_by_the_other():
    for config in (learning(), learning(max_grad_norm=1.0, learning_rate_duration=0)):
        learner = new_learner(NETWORKS["dueling"], config)
        learner.update(batches(8), None, SEEN, 0, measured=False)
        _, twin = twin_of(learner, config)
        for name, tensor in tensors_of(twin).items():
            assert_array_equal(learner.tensors()[name], tensor)


def test_the_kernel_reads_each_field_of_a_packed_transition_where_it_is():
    transition_fields = getattr(_fused, "transition_fields", None)
    if transition_fields is None:
        pytest.skip("this build of the kernel does not say where it reads them")
    for size in (1, 8):
        assert transition_fields(size) == field_offsets(size)


NOISY = {
    "noisy": NetworkConfig(hidden_sizes=(16, 9), noisy=True),
    "noisy, normalised, dueling": NetworkConfig(
        hidden_sizes=(13, 7), noisy=True, layer_norm=True, dueling=True
    ),
    "rainbow": NetworkConfig(
        hidden_sizes=(16,), noisy=True, layer_norm=True, dueling=True, atoms=11
    ),
}


@pytest.mark.parametrize(
    ("name", "double"),
    [("noisy", True), ("noisy, normalised, dueling", False), ("rainbow", True)],
)
def test_noisy_networks_have_the_noise_that_jax_draws(name, double):
    shape = NOISY[name]
    config = Config(seed=7, network=shape, learning=learning(double=double, max_grad_norm=0.1))
    ours = FusedLearner(FusedNetwork(D, A, shape), config)
    twin = JaxLearner(QNetwork(D, A, shape), config)
    packed, weights = batches(21), np.random.default_rng(1).random((K, 21), np.float32)
    assert_allclose(ours.values(SEEN, 5), twin.values(SEEN, 5), atol=1e-5)
    for updates in (0, K):
        got = ours.update(packed, weights, SEEN, updates, measured=True)
        expected = twin.update(packed, weights, SEEN, updates, measured=True)
        assert_allclose(got.td_error, expected.td_error, rtol=2e-3, atol=1e-4)
        assert_allclose(got.next_q, expected.next_q, rtol=2e-3, atol=1e-4)
        assert_allclose(got.metrics, expected.metrics, rtol=2e-3, atol=1e-4)
    assert_same_state(ours, twin.state)


def test_a_noisy_network_has_new_noise_at_each_step_and_acts_greedily_without_any():
    shape = NOISY["noisy"]
    learner = FusedLearner(FusedNetwork(D, A, shape), Config(seed=7, network=shape))
    assert_array_equal(learner.values(SEEN, 5), learner.values(SEEN, 5))
    assert np.abs(learner.values(SEEN, 5) - learner.values(SEEN, 6)).max() > 0.01
    params = learner.state.online_params
    greedy = learner.model.policy(params).values(SEEN)
    assert_array_equal(greedy, learner.model.values_of_each(params, SEEN))
    assert_allclose(greedy, QNetwork(D, A, shape).apply(jnp.array(params), SEEN), atol=1e-5)


def test_noise_is_for_noisy_networks_only():
    with pytest.raises(ValueError, match="noise: must be None for a network that is not noisy"):
        Perceptron(D, [4], A).learn(**perceptron_call(noise=(1, 2, 3)))
    shape = NOISY["noisy"]
    learner = FusedLearner(FusedNetwork(D, A, shape), Config(network=shape))
    samples = np.zeros((2, D), np.float32), np.zeros(2, np.int32), np.zeros(2, np.float32)
    with pytest.raises(ValueError, match="a noisy network: must have no noise"):
        learner.fit(*samples, np.array([[0, 1]]))


def test_a_network_that_predicts_a_distribution_is_not_fitted_to_values():
    learner = new_learner(DISTRIBUTIONS["atoms"], learning(loss="huber"))
    before = np.array(learner.state.online_params)
    samples = np.zeros((2, D), np.float32), np.zeros(2, np.int32), np.zeros(2, np.float32)
    with pytest.raises(ValueError, match="predicts quantiles or atoms: must predict values"):
        learner.fit(*samples, np.array([[0, 1]]))
    assert_array_equal(learner.state.online_params, before)


AGENTS = {
    "dqn": Config(
        replay=ReplayConfig(capacity=100, min_size=8),
        learning=LearningConfig(batch_size=8, target_period=20, double=True, n_step=2),
    ),
    "noisy": Config(
        network=NetworkConfig(noisy=True),
        replay=ReplayConfig(capacity=100, min_size=8),
        learning=LearningConfig(batch_size=8, target_period=20),
    ),
    "quantiles": Config(
        network=NetworkConfig(quantiles=6),
        replay=ReplayConfig(capacity=100, min_size=8, prioritized=True),
        learning=LearningConfig(batch_size=8, target_period=20, loss="huber"),
    ),
    "atoms": Config(
        network=NetworkConfig(atoms=6),
        replay=ReplayConfig(capacity=100, min_size=8),
        learning=LearningConfig(batch_size=8, target_period=20, double=True, n_step=3),
    ),
    "pqn": Config(algorithm="pqn", rollout=RolloutConfig(rollout_steps=8, epochs=2, minibatches=2)),
}


@pytest.mark.parametrize("config", AGENTS.values(), ids=AGENTS)
def test_an_agent_learns_the_same_on_either_backend(chain, config):
    def learned(backend: str) -> np.ndarray:
        settings = replace(
            config,
            network=replace(config.network, hidden_sizes=(16,), layer_norm=True),
            exploration=ExplorationConfig(schedule="constant", epsilon_start=1.0),
            learning=replace(config.learning, backend=backend),
            training=TrainingConfig(num_envs=4),
        )
        agent = make_agent(settings, SPACES, streams(0))
        for _ in islice(fly(agent, *(chain(20) for _ in range(4))), 64):
            pass
        assert agent.updates > 10
        return np.array(agent.learner.state.online_params)

    assert_allclose(learned("fused"), learned("jax"), rtol=1e-3, atol=1e-4)


def perceptron_call(**changes: Any) -> dict[str, Any]:
    size = Perceptron(D, [4], A).num_params
    arguments: dict[str, Any] = {
        name: np.zeros(size, np.float32) for name in ("online", "target", "mu", "nu")
    }
    arguments |= {
        "num_updates": 0,
        "rates": np.zeros(K, np.float32),
        "packed": batches(8),
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
        ({"packed": np.full((K, 8, 15), 7, np.int32).view(np.float32)}, "action 7: must be from 0"),
        ({"packed": batches(8)[:, :, :-1].copy()}, "a transition has 14 entries, must have 15"),
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
    monkeypatch.setattr(fused_network, "is_built", lambda: False)
    config = Config(learning=LearningConfig(backend="fused"))
    with pytest.raises(UserError, match=r"backend = 'fused': the kernel was not built.*'jax'"):
        make_learner(config, SPACES)


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

    def learned(name: str) -> list[str]:
        environment = {**os.environ, "TOUCHDOWN_SIMD": name}
        said = subprocess.run(
            [sys.executable, "-c", program],
            env=environment,
            capture_output=True,
            text=True,
            check=False,  # refused where the processor has no such instructions
        )
        return said.stdout.split()

    widest = learned(simd())
    assert widest[0] == simd()
    for name in ("baseline", "avx2"):
        others = learned(name)
        if not others:
            continue  # this processor does not have it
        assert others[0] == name
        assert_allclose(
            [float(p) for p in others[1:]], [float(p) for p in widest[1:]], rtol=2e-3, atol=2e-4
        )
    assert learned("baseline")
