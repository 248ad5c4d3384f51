import json

import jax
import numpy as np
import pytest
from safetensors.numpy import load, save, save_file

from saved_policies import save_model
from single_changes import is_refused_in_a_line, single_changes
from touchdown.agents.networks import QNetwork
from touchdown.agents.registry import make_agent
from touchdown.config.config import Config
from touchdown.config.presets import preset
from touchdown.config.sections import NetworkConfig
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.core.seeding import streams
from touchdown.envs import environment
from touchdown.policies import weights as policy_weights
from touchdown.policies.facts import WeightsFacts

CONFIG = preset("tabular-q")
FACTS = WeightsFacts(env_steps=9, validation_return=0.5, final_validation_return=0.25)


@pytest.fixture
def path(tmp_path):
    agent = make_agent(CONFIG, environment.spaces_of(CONFIG.env_id), streams(0))
    path = tmp_path / "best.safetensors"
    policy_weights.save_weights(path, agent.weights(), agent.policy(agent.weights()), FACTS, CONFIG)
    return path


def rewrite(path, **changes):
    """The same arrays with other texts; None leaves one out."""
    tensors, texts = files.read_tensors(path)
    other = {name: text for name, text in (texts | changes).items() if text is not None}
    path.write_bytes(save(tensors, other))


def read_all(path):
    policy_weights.load_weights(path)
    policy_weights.facts_of(path)
    policy_weights.origin_of(path)


def test_facts_come_back_under_the_names_that_they_are_stored_by(path):
    assert policy_weights.facts_of(path) == FACTS
    assert policy_weights.final_return_of(path) == 0.25
    assert policy_weights.origin_of(path) == ("tabular-q", 0)
    _, texts = files.read_tensors(path)
    assert json.loads(texts["facts"]) == {
        "observations": 9, "validation_return": 0.5, "final_validation_return": 0.25,
    }  # fmt: skip


@pytest.mark.parametrize("name", ["facts", "table"])
def test_one_wrong_value_in_a_text_is_reported_in_one_line(path, name):
    _, texts = files.read_tensors(path)
    refused = 0
    for other in single_changes(json.loads(texts[name])):
        rewrite(path, **{name: json.dumps(other)})
        refused += is_refused_in_a_line(lambda: read_all(path), str(path))
    assert refused > 20


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"facts": "{"}, r"\[facts\]: not JSON"),
        ({"seed": "seven"}, "seed = 'seven': must be a whole number"),
        ({"seed": None}, "seed = None: must be a whole number"),
        ({"preset": None}, "preset: missing"),
        ({"env_id": None}, "not a policy's weights: env_id: missing"),
        ({"table": None}, "not a policy's weights: must describe either a network or a table"),
        (
            {"table": '{"layers": 3}'},
            "not a policy's weights: unknown field 'layers'; must be one of bins",
        ),
    ],
)
def test_texts_that_are_missing_or_wrong_are_refused(path, changes, said):
    rewrite(path, **changes)
    with pytest.raises(UserError, match=said) as refused:
        read_all(path)
    assert str(refused.value).startswith(str(path))


def test_weights_that_were_not_chosen_have_no_final_return(path):
    rewrite(path, facts='{"observations": 9}')
    with pytest.raises(UserError, match=r"\[facts\]: final_validation_return: missing"):
        policy_weights.final_return_of(path)


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
    save_model(lander, network, params, FACTS, config)
    assert policy_weights.load_weights(lander).env_id == "LunarLander-v3"
    tensors, metadata = files.read_tensors(lander)
    path = tmp_path / "cart.safetensors"
    save_file(tensors, path, metadata | {"env_id": "CartPole-v1"})
    with pytest.raises(
        UserError,
        match=r"for env_id 'CartPole-v1': layers.0.weight is .*\(8, 8\), must be .*\(8, 4\)",
    ):
        policy_weights.load_weights(path)


def test_metadata_of_another_kind_is_refused(path):
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    header = json.loads(data[8 : 8 + size]) | {"__metadata__": None}
    text = json.dumps(header).encode()
    path.write_bytes(len(text).to_bytes(8, "little") + text + data[8 + size :])
    assert load(path.read_bytes())  # the library reads it
    with pytest.raises(UserError, match="__metadata__ = None: must be an object"):
        policy_weights.load_weights(path)
