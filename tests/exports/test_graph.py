import jax
import numpy as np
import onnx
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from touchdown.agents.networks import QNetwork
from touchdown.agents.qtable import QTable
from touchdown.agents.states import Grid, OneHot
from touchdown.config.sections import NetworkConfig, TableConfig
from touchdown.exports.graph import IR_VERSION, OPSET, onnx_model
from touchdown.policies.foreign.onnx_session import Session

D, A = 5, 3
OBSERVATIONS = np.random.default_rng(0).normal(size=(40, D)).astype(np.float32)


def run(model: QNetwork | QTable, params: np.ndarray, observations: np.ndarray):
    data = onnx_model(model, params, observations.shape[1], A, {})
    return Session(data).run(observations, ["q_values", "action"])


def linear(weights: list[list[float]], bias: list[float]) -> tuple[QNetwork, np.ndarray]:
    network = QNetwork(2, A, NetworkConfig(hidden_sizes=()))
    layers = {"layers.0.weight": weights, "layers.0.bias": bias}
    return network, network.params_of({k: np.array(v, np.float32) for k, v in layers.items()})


def test_a_linear_network_gives_the_values_worked_out_by_hand():
    network, params = linear([[1, 0], [0, 1], [-1, -1]], [0, 0.5, 1])
    q, action = run(network, params, np.array([[2, 1], [0, 0], [1, 1.5]], np.float32))
    assert_array_equal(q, [[2, 1.5, -2], [0, 0.5, 1], [1, 2, -1.5]])
    assert_array_equal(action, [0, 2, 1])
    assert (q.dtype, action.dtype) == (np.float32, np.int64)


def test_of_equal_values_the_first_action_is_taken():
    network, params = linear([[0, 0], [0, 0], [0, 0]], [1, 2, 2])
    assert_array_equal(run(network, params, np.ones((1, 2), np.float32))[1], [1])


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"hidden_sizes": ()},
        {"hidden_sizes": (7, 6, 5), "activation": "tanh"},
        {"activation": "silu"},
        {"layer_norm": True},
        {"dueling": True},
        {"quantiles": 1},
        {"quantiles": 4},
        {"atoms": 3, "v_min": -2.0, "v_max": 5.0},
        {"noisy": True, "noisy_sigma": 20.0},
        {"dueling": True, "quantiles": 4, "layer_norm": True, "activation": "silu"},
        {"dueling": True, "atoms": 5, "noisy": True, "hidden_sizes": ()},
    ],
    ids=str,
)
def test_every_network_gives_the_values_of_its_policy(settings):
    network = QNetwork(D, A, NetworkConfig(**{"hidden_sizes": (8, 6), **settings}))
    # wider than at initialisation: no two parts are alike, and normalisation has an effect
    params = np.asarray(jax.random.normal(jax.random.key(1), (network.num_params,)))
    expected = np.asarray(network.values(params, OBSERVATIONS))
    q, action = run(network, params, OBSERVATIONS)
    assert_allclose(q, expected, rtol=2e-5, atol=2e-5)
    assert_array_equal(action, expected.argmax(axis=1))
    assert np.ptp(expected, axis=0).min() > 0.1  # decoys: the value of every action varies


def test_any_number_of_observations_fits():
    network = QNetwork(D, A, NetworkConfig(hidden_sizes=(8,), quantiles=2, dueling=True))
    params = np.asarray(network.init(jax.random.key(0)))
    for count in (0, 1, 7):
        q, action = run(network, params, OBSERVATIONS[:count])
        assert (q.shape, action.shape) == ((count, A), (count,))


def test_a_table_over_a_grid_gives_the_values_of_its_policy():
    grid = Grid((2, 3, 4), (-1.0, 0.0, -2.0), (1.0, 0.3, 2.0))
    config = TableConfig(bins=grid.bins, bins_low=grid.low, bins_high=grid.high)
    params = np.random.default_rng(0).normal(size=24 * A)
    table = QTable(grid, A, config)
    edges = [[0, 0.1, 0], [0, 0.2, 1], [1, 0.3, 2], [-1, 0, -2], [9, np.inf, -9], [-9, -np.inf, 9]]
    spread = np.random.default_rng(1).uniform((-2, -0.1, -3), (2, 0.4, 3), size=(2_000, 3))
    observations = np.concatenate((edges, spread)).astype(np.float32)
    policy = table.policy(params)
    q, action = run(table, params, observations)
    assert_array_equal(q, policy.values(observations).astype(np.float32))
    assert_array_equal(action, policy.act(observations))
    assert len(np.unique(q[:, 0])) == 24  # every cell was seen


def test_a_table_of_states_is_looked_up_by_the_index_of_the_one_hot():
    table = QTable(OneHot(2), A, TableConfig())
    # in single precision the first row's last two are equal, and the first of equals would win
    rows = np.array([[0.0, 1.0, 1.0 + 1e-12], [3.0, 2.0, 1.0]])
    q, action = run(table, rows.ravel(), np.array([[0, 1], [1, 0]], np.float32))
    assert_array_equal(q, rows[::-1].astype(np.float32))
    assert_array_equal(action, [0, 2])


def test_the_file_has_metadata_and_fixed_versions_for_older_runtimes():
    network, params = linear([[1, 0], [0, 1], [-1, -1]], [0, 0, 0])
    data = onnx_model(network, params, 2, A, {"env_id": "LunarLander-v3", "note": "ä"})
    made = onnx.load_model_from_string(data)
    assert (made.ir_version, made.opset_import[0].version) == (IR_VERSION, OPSET) == (8, 17)
    assert made.producer_name == "touchdown"
    model = Session(data)
    assert model.metadata == {"env_id": "LunarLander-v3", "note": "ä"}
    assert model.inputs == [("observations", "tensor(float)", ["N", 2])]
    assert [port.name for port in model.outputs] == ["q_values", "action"]
    assert onnx_model(network, params, 2, A, {"env_id": "LunarLander-v3", "note": "ä"}) == data
