import jax
import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose

from touchdown.agents.networks import QNetwork
from touchdown.config.sections import NetworkConfig

ACTIVATIONS = {
    "relu": lambda x: np.maximum(x, 0),
    "tanh": np.tanh,
    "silu": lambda x: x / (1 + np.exp(-x)),
}


def forward(layers: dict[str, jax.Array], observation: np.ndarray, activation) -> np.ndarray:
    """The slow twin: one observation, layer after layer, in double precision."""
    x, depth = observation.astype(float), len(layers) // 2
    for i in range(depth):
        x = np.asarray(layers[f"layers.{i}.weight"], float) @ x
        x = x + np.asarray(layers[f"layers.{i}.bias"], float)
        if i < depth - 1:
            x = activation(x)
    return x


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_values_of_a_batch_are_a_plain_forward_pass_of_each_observation(activation: str):
    network = QNetwork(5, 2, NetworkConfig(hidden_sizes=(16, 16), activation=activation))
    params = network.init(jax.random.key(1))
    observations = default_rng(0).normal(size=(20, 5)).astype(np.float32) * 3
    layers = network.layers(params)
    slow = [forward(layers, observation, ACTIVATIONS[activation]) for observation in observations]
    assert_allclose(network.apply(params, observations), slow, rtol=1e-4, atol=1e-5)
    assert_allclose(network.values(params, observations), slow, rtol=1e-4, atol=1e-5)
    assert np.min(slow) < 0 < np.max(slow)  # no activation after the last layer


def test_without_hidden_layers_values_are_linear_in_the_observation():
    network = QNetwork(2, 3, NetworkConfig(hidden_sizes=()))
    assert network.num_params == 9
    params = np.array([1, 2, 3, 4, 5, 6, 10, 20, 30], np.float32)  # weights by row, then biases
    assert network.apply(params, np.array([[1, 0], [0, 1]], np.float32)).tolist() == [
        [11, 23, 35],
        [12, 24, 36],
    ]


def test_layers_name_every_parameter_once(network: QNetwork):
    params = np.arange(network.num_params, dtype=np.float32)
    layers = network.layers(params)
    assert {name: array.shape for name, array in layers.items()} == {
        "layers.0.weight": (16, 5),
        "layers.0.bias": (16,),
        "layers.1.weight": (16, 16),
        "layers.1.bias": (16,),
        "layers.2.weight": (2, 16),
        "layers.2.bias": (2,),
    }
    assert network.num_params == 16 * 5 + 16 + 16 * 16 + 16 + 2 * 16 + 2
    assert np.array_equal(np.sort(np.concatenate([np.ravel(a) for a in layers.values()])), params)


def test_fresh_parameters_are_spread_over_one_over_the_root_of_the_fan_in(network: QNetwork):
    layers = network.layers(network.init(jax.random.key(0)))
    for i, fan_in in enumerate((5, 16, 16)):
        for kind in ("weight", "bias"):
            sizes = np.abs(layers[f"layers.{i}.{kind}"])
            assert sizes.max() <= fan_in**-0.5
        spread = np.std(layers[f"layers.{i}.weight"])
        assert spread == pytest.approx((3 * fan_in) ** -0.5, rel=0.25)  # of a uniform distribution


def test_fresh_parameters_repeat_with_the_key_and_differ_between_keys_and_layers(
    network: QNetwork,
):
    one, same, other = (np.asarray(network.init(jax.random.key(key))) for key in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.isin(one, other).any()
    assert len(np.unique(one)) == network.num_params


def test_a_dueling_head_adds_the_value_to_advantages_whose_mean_is_nothing():
    network = QNetwork(3, 4, NetworkConfig(hidden_sizes=(), dueling=True))
    named = {
        "value.weight": [[1, 0, 0]],
        "value.bias": [10],
        "advantage.weight": [[0, 0, 0], [0, 1, 0], [0, 0, 0], [0, 0, 0]],
        "advantage.bias": [0, 0, 2, 6],
    }
    params = network.params_of({name: np.array(v, np.float32) for name, v in named.items()})
    q = network.apply(params, np.array([[5.0, 4.0, 99.0]], np.float32))
    # V = 15; A = 0, 4, 2, 6 with a mean of 3
    assert_allclose(q, [[12.0, 16.0, 14.0, 18.0]])


def test_layer_normalisation_comes_before_the_activation():
    network = QNetwork(2, 1, NetworkConfig(hidden_sizes=(2,), layer_norm=True))
    named = {
        "layers.0.weight": [[1, 0], [0, 1]],
        "layers.0.bias": [0, 0],
        "norms.0.weight": [1, 1],
        "norms.0.bias": [0, 5],
        "layers.1.weight": [[100, 1]],
        "layers.1.bias": [0],
    }
    params = network.params_of({name: np.array(v, np.float32) for name, v in named.items()})
    q = network.apply(params, np.array([[3.0, 7.0]], np.float32))
    # -2 and 2 about their mean, over a deviation of 2: -1 is cut off, and 1 + 5 stays
    assert_allclose(q, [[6.0]], rtol=1e-5)


@pytest.mark.parametrize("dueling", [False, True])
@pytest.mark.parametrize("layer_norm", [False, True])
@pytest.mark.parametrize("noisy", [False, True])
def test_parameters_by_name_make_the_same_network_again(
    dueling: bool, layer_norm: bool, noisy: bool
):
    config = NetworkConfig(hidden_sizes=(6, 5), dueling=dueling, layer_norm=layer_norm, noisy=noisy)
    network = QNetwork(3, 4, config)
    params = network.init(jax.random.key(3))
    named = {name: np.asarray(value) for name, value in network.layers(params).items()}
    assert np.array_equal(network.params_of(named), params)
    with pytest.raises(ValueError, match=r"it has .* must be"):
        network.params_of(named | {"more": np.zeros(1, np.float32)})
    name = next(iter(named))
    with pytest.raises(ValueError, match=f"{name} is float64"):
        network.params_of(named | {name: named[name].astype(float)})


@pytest.mark.parametrize("dueling", [False, True])
def test_q_is_the_mean_of_the_quantiles(dueling: bool):
    network = QNetwork(3, 4, NetworkConfig(hidden_sizes=(6,), quantiles=5, dueling=dueling))
    params = network.init(jax.random.key(0))
    seen = default_rng(0).normal(size=(7, 3)).astype(np.float32)
    theta = network.quantiles(params, seen)
    assert theta.shape == (7, 4, 5)
    assert_allclose(network.apply(params, seen), theta.mean(axis=2), rtol=1e-5, atol=1e-6)


def test_a_dueling_head_of_quantiles_takes_each_quantile_s_mean_away():
    network = QNetwork(1, 2, NetworkConfig(hidden_sizes=(), dueling=True, quantiles=2))
    named = {
        "value.weight": [[0], [0]],
        "value.bias": [10, 20],
        "advantage.weight": [[0]] * 4,
        "advantage.bias": [1, 5, 3, 9],
    }
    params = network.params_of({name: np.array(v, np.float32) for name, v in named.items()})
    theta = network.quantiles(params, np.zeros((1, 1), np.float32))
    assert_allclose(theta, [[[10 - 1, 20 - 2], [10 + 1, 20 + 2]]])


# --- atoms ---


def test_atoms_stand_at_equal_distances_from_end_to_end():
    network = QNetwork(1, 2, NetworkConfig(hidden_sizes=(), atoms=5, v_min=-2, v_max=6))
    assert network.support.tolist() == [-2, 0, 2, 4, 6]


def test_q_is_the_mean_of_the_atoms_by_their_probabilities():
    network = QNetwork(1, 2, NetworkConfig(hidden_sizes=(), atoms=3, v_min=-1, v_max=1))
    p = np.array([[0.5, 0.25, 0.25], [0.125, 0.125, 0.75]])
    params = np.concatenate([np.zeros(6), np.log(p).ravel() + 7]).astype(np.float32)
    seen = np.zeros((1, 1), np.float32)
    assert_allclose(network.apply(params, seen), [[-0.25, 0.625]], rtol=1e-5)
    assert_allclose(network.log_probabilities(params, seen), [np.log(p)], rtol=1e-5)


@pytest.mark.parametrize("dueling", [False, True])
def test_each_action_of_each_observation_has_its_own_probabilities(dueling: bool):
    config = NetworkConfig(hidden_sizes=(6,), atoms=5, v_min=0, v_max=8, dueling=dueling)
    network = QNetwork(3, 4, config)
    params = network.init(jax.random.key(0))
    seen = default_rng(0).normal(size=(7, 3)).astype(np.float32)
    p = np.exp(network.log_probabilities(params, seen))
    assert p.shape == (7, 4, 5)
    assert len(np.unique(p.round(7).reshape(28, 5), axis=0)) == 28
    assert_allclose(p.sum(axis=2), np.ones((7, 4)), rtol=1e-5)
    assert_allclose(network.apply(params, seen), p @ [0, 2, 4, 6, 8], rtol=1e-5)


# --- noisy weights ---


def noisy_pair(**settings) -> tuple[QNetwork, QNetwork]:
    """A network, and the same one with noisy weights."""
    config = {"hidden_sizes": (16,), **settings}
    plain, noisy = (QNetwork(5, 2, NetworkConfig(**config, noisy=on)) for on in (False, True))
    return plain, noisy


SEEN = default_rng(0).normal(size=(20, 5)).astype(np.float32)


@pytest.mark.parametrize("dueling", [False, True])
@pytest.mark.parametrize("layer_norm", [False, True])
def test_without_a_key_a_noisy_network_is_the_plain_one_of_its_means(
    dueling: bool, layer_norm: bool
):
    plain, noisy = noisy_pair(dueling=dueling, layer_norm=layer_norm)
    params = noisy.init(jax.random.key(1))
    means = {
        name: np.asarray(value)
        for name, value in noisy.layers(params).items()
        if "sigma" not in name
    }
    assert np.array_equal(plain.params_of(means), plain.init(jax.random.key(1)))
    assert_allclose(noisy.apply(params, SEEN), plain.apply(plain.params_of(means), SEEN))
    assert not np.allclose(noisy.apply(params, SEEN, jax.random.key(0)), noisy.apply(params, SEEN))


@pytest.mark.parametrize("parts", [{}, {"dueling": True}, {"quantiles": 3}, {"atoms": 3}])
def test_one_key_repeats_its_noise_for_a_whole_batch_and_two_keys_differ(parts):
    _, noisy = noisy_pair(**parts)
    params = noisy.init(jax.random.key(1))
    one, other = jax.random.key(1), jax.random.key(2)
    together = noisy.apply(params, SEEN, one)
    assert np.array_equal(together, noisy.apply(params, SEEN, one))
    assert not np.isclose(together, noisy.apply(params, SEEN, other)).any()
    alone = [noisy.apply(params, SEEN[i : i + 1], one)[0] for i in range(5)]
    assert_allclose(together[:5], alone, rtol=1e-4, atol=1e-5)


def test_values_quantiles_and_probabilities_share_the_noise_of_one_key():
    key = jax.random.key(4)
    _, noisy = noisy_pair(quantiles=3)
    params = noisy.init(jax.random.key(1))
    theta = noisy.quantiles(params, SEEN, key)
    assert_allclose(noisy.apply(params, SEEN, key), theta.mean(axis=2), rtol=1e-5, atol=1e-6)
    _, noisy = noisy_pair(atoms=3)
    params = noisy.init(jax.random.key(1))
    p = np.exp(noisy.log_probabilities(params, SEEN, key))
    assert_allclose(noisy.apply(params, SEEN, key), p @ noisy.support, rtol=1e-4, atol=1e-5)


def test_noisy_layers_name_their_deviations_after_their_means():
    network = QNetwork(3, 2, NetworkConfig(hidden_sizes=(4,), noisy=True, layer_norm=True))
    layers = network.layers(np.arange(network.num_params, dtype=np.float32))
    assert {name: array.shape for name, array in layers.items()} == {
        "layers.0.weight": (4, 3),
        "layers.0.bias": (4,),
        "layers.0.weight_sigma": (4, 3),
        "layers.0.bias_sigma": (4,),
        "norms.0.weight": (4,),
        "norms.0.bias": (4,),
        "layers.1.weight": (2, 4),
        "layers.1.bias": (2,),
        "layers.1.weight_sigma": (2, 4),
        "layers.1.bias_sigma": (2,),
    }
    flat = np.concatenate([np.ravel(array) for array in layers.values()])
    assert np.array_equal(flat, np.arange(network.num_params))  # in this order, too
    fresh = network.layers(network.init(jax.random.key(0)))
    assert_allclose(fresh["layers.0.weight_sigma"], np.full((4, 3), 0.5 / 3**0.5), rtol=1e-6)
    assert_allclose(fresh["layers.1.bias_sigma"], [0.25, 0.25])


def test_a_noisy_dueling_head_names_its_deviations_too():
    network = QNetwork(3, 2, NetworkConfig(hidden_sizes=(), noisy=True, dueling=True))
    kinds = ("weight", "bias", "weight_sigma", "bias_sigma")
    names = [f"{part}.{kind}" for part in ("value", "advantage") for kind in kinds]
    assert list(network.layers(np.zeros(network.num_params, np.float32))) == names
