import json
import time
import tracemalloc

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
        ({"reward_scale": "0"}, "weights: reward_scale = '0': must be a number above 0"),
        ({"reward_scale": "nan"}, "weights: reward_scale = 'nan': must be a number above 0"),
        ({"reward_scale": "ten"}, "weights: reward_scale = 'ten': must be a number above 0"),
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


def test_the_scale_of_the_rewards_comes_back_and_is_one_in_files_without_it(path):
    rewrite(path, reward_scale="0.25")
    assert policy_weights.load_weights(path).reward_scale == 0.25
    rewrite(path, reward_scale=None)
    assert policy_weights.load_weights(path).reward_scale == 1.0


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


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_weights_that_are_not_finite_are_neither_written_nor_read(path, tmp_path, value):
    agent = make_agent(CONFIG, environment.spaces_of(CONFIG.env_id), streams(0))
    weights = agent.weights()
    weights["q"][3, 1] = value
    policy = agent.policy(agent.weights())
    other = tmp_path / "other.safetensors"
    with pytest.raises(UserError, match=r"not written: q has 1 of \d+ numbers that are not finite"):
        policy_weights.save_weights(other, weights, policy, FACTS, CONFIG)
    assert not other.exists()
    _, texts = files.read_tensors(path)
    path.write_bytes(save(weights, texts))
    with pytest.raises(
        UserError, match=r"q has 1 of \d+ numbers that are not finite; its training"
    ):
        read_all(path)


# --- limits on what a file becomes ---


def hostile(path, *, hidden_sizes=(), tensors=None, **texts):
    """A file of weights that describes this network, however few weights it has."""
    network = json.dumps({"hidden_sizes": hidden_sizes})
    metadata = {"format_version": "2", "env_id": "LunarLander-v3", "network": network, **texts}
    path.write_bytes(save(tensors or {"w": np.zeros((8, 8), np.float32)}, metadata))
    return path


@pytest.mark.parametrize(
    ("described", "said"),
    [
        ({"hidden_sizes": [1] * 101}, "hidden_sizes: has 101 layers, must be at most 100"),
        ({"hidden_sizes": [1] * 300_000}, "hidden_sizes: has 300000 layers, must be at most 100"),
        ({"hidden_sizes": [100_000, 100_000]}, "it has 64 numbers, fewer than the network"),
        ({"hidden_sizes": [9, 9]}, "it has 64 numbers, fewer than the network"),
        ({"hidden_sizes": [2**63]}, "hidden_sizes"),
        (
            {"network": '{"atoms": 100000}', "hidden_sizes": []},
            "it has 64 numbers, fewer than the network",
        ),
        (
            {"tensors": {f"{n}": np.zeros(1, np.float32) for n in range(10_001)}},
            "has 10001 arrays, must be at most 10000",
        ),
        ({"facts": "[]," * 400_000}, r"\[facts\]: has 1200000 characters, must be at most 1048576"),
        ({"tensors": {"w": np.zeros(3, np.float16)}}, "it has \\['w'\\], must be"),
    ],
)
def test_a_small_file_that_would_become_large_is_refused_at_once(tmp_path, described, said):
    path = hostile(tmp_path / "h.safetensors", **described)
    tracemalloc.start()
    began = time.monotonic()
    with pytest.raises(UserError, match=said) as refused:
        read_all(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert "\n" not in str(refused.value)
    assert peak < 100e6
    assert time.monotonic() - began < 20


def test_a_header_beyond_the_limit_is_not_parsed(tmp_path):
    path = hostile(tmp_path / "h.safetensors", note="x" * (17 << 20))
    with pytest.raises(UserError, match=r"its header has \d+ bytes, must be at most 16777216"):
        read_all(path)


def test_a_file_beyond_the_limit_is_not_read(tmp_path):
    path = tmp_path / "h.safetensors"
    with path.open("wb") as file:
        file.truncate((512 << 20) + 1)
    with pytest.raises(UserError, match="has 536870913 bytes, must be at most 536870912"):
        read_all(path)
