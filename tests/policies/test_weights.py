import jax
import numpy as np
import pytest
from safetensors.numpy import save_file

from touchdown.agents.networks import QNetwork
from touchdown.config.config import Config
from touchdown.config.sections import NetworkConfig
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.policies import weights as policy_weights


def test_weights_of_another_network_are_refused(tmp_path):
    path = tmp_path / "odd.safetensors"
    save_file({"w": np.zeros(3, np.float32)}, path)
    with pytest.raises(UserError, match="format_version = None"):
        policy_weights.load_weights(path)
    save_file({"w": np.zeros(3, np.float32)}, path, {"format_version": "2"})
    with pytest.raises(UserError, match="not a policy's weights"):
        policy_weights.load_weights(path)


def test_weights_for_another_environment_than_they_say_are_refused(tmp_path):
    config = Config(network=NetworkConfig(hidden_sizes=(8,)))
    network = QNetwork(8, 4, config.network)
    lander = tmp_path / "lander.safetensors"
    params = np.asarray(network.init(jax.random.key(0)))
    policy_weights.save_weights(lander, network, params, {}, config)
    assert policy_weights.load_weights(lander).env_id == "LunarLander-v3"
    tensors, metadata = files.read_tensors(lander)
    path = tmp_path / "cart.safetensors"
    save_file(tensors, path, metadata | {"env_id": "CartPole-v1"})
    with pytest.raises(
        UserError,
        match=r"for env_id 'CartPole-v1': layers.0.weight is .*\(8, 8\), must be .*\(8, 4\)",
    ):
        policy_weights.load_weights(path)
