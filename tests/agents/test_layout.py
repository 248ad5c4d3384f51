import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from touchdown.agents.initial import initial_params
from touchdown.agents.layout import Layout
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import NetworkConfig

NETWORKS = {
    "linear": NetworkConfig(hidden_sizes=()),
    "two layers": NetworkConfig(hidden_sizes=(33, 17)),
    "normalised": NetworkConfig(hidden_sizes=(5, 6), layer_norm=True),
    "dueling quantiles": NetworkConfig(hidden_sizes=(9,), dueling=True, quantiles=5),
    "noisy dueling atoms": NetworkConfig(hidden_sizes=(7, 8), dueling=True, noisy=True, atoms=3),
}


@pytest.mark.parametrize("config", NETWORKS.values(), ids=NETWORKS)
def test_parameters_are_where_the_jax_network_reads_them(config):
    network, layout = QNetwork(6, 3, config), Layout(6, 3, config)
    numbers = np.arange(layout.num_params, dtype=np.float32)
    leaves = filter(eqx.is_array, jax.tree.leaves(network.module(jnp.array(numbers))))
    named = layout.split(numbers)
    for (name, ours), leaf in zip(named.items(), leaves, strict=True):
        assert_array_equal(ours, leaf, err_msg=name)
    assert_array_equal(layout.join(named), numbers)


@pytest.mark.parametrize("config", NETWORKS.values(), ids=NETWORKS)
def test_initial_parameters_are_those_of_the_jax_network(config):
    network = QNetwork(6, 3, config)
    for seed in (0, 1, 2**31 + 5, 2**32 - 1):
        ours, twin = initial_params(network.layout, seed), network.init(jax.random.key(seed))
        # where the processor does not fuse product and sum, JAX rounds twice
        np.testing.assert_allclose(ours, twin, rtol=0, atol=2**-24)


def test_parameters_of_other_names_shapes_or_types_are_refused():
    layout = Layout(2, 3, NetworkConfig(hidden_sizes=()))
    named = {"layers.0.weight": np.zeros((3, 2), np.float32), "layers.0.bias": np.zeros(3)}
    with pytest.raises(ValueError, match=r"layers.0.bias is float64\(3,\), must be float32\(3,\)"):
        layout.join(named)
    with pytest.raises(ValueError, match=r"it has \['layers.0.bias'\], must be"):
        layout.join({"layers.0.bias": named["layers.0.bias"]})
