"""Policies in JavaScript act as those in Python do."""

import json
import os
import subprocess
import sys
from base64 import b64decode
from dataclasses import asdict
from functools import cache
from typing import Any

import numpy as np
from javascript import ACE, MODULE, encoded, in_node
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from safetensors.numpy import save

from single_changes import single_changes
from touchdown.agents.layout import Layout
from touchdown.config.sections import NetworkConfig
from touchdown.control.pid import PIDPolicy
from touchdown.lander.single import LanderEnv
from touchdown.policies.baselines import HeuristicPolicy, shipped_pid
from touchdown.policies.weights import load_weights

# the values of each file in a folder, computed with the instruction set in TOUCHDOWN_SIMD
BASELINE = """
import sys
from pathlib import Path
import numpy as np
from touchdown.policies.weights import load_weights
folder = Path(sys.argv[1])
observations = np.load(folder / "observations.npy")
for path in folder.glob("*.safetensors"):
    np.save(f"{path}.npy", load_weights(path).policy.values(observations))
"""
KINDS = {
    "plain": NetworkConfig(hidden_sizes=(16, 7)),
    "linear": NetworkConfig(hidden_sizes=()),
    "tanh": NetworkConfig(hidden_sizes=(9, 5), activation="tanh"),
    "silu": NetworkConfig(hidden_sizes=(9, 5), activation="silu", layer_norm=True),
    "layer norm": NetworkConfig(hidden_sizes=(33, 6), layer_norm=True),
    "dueling": NetworkConfig(hidden_sizes=(12,), dueling=True),
    "quantiles": NetworkConfig(hidden_sizes=(12,), quantiles=5),
    "atoms": NetworkConfig(hidden_sizes=(12,), atoms=11, v_min=-2.0, v_max=3.0),
    "noisy": NetworkConfig(hidden_sizes=(12, 8), noisy=True),
    "all": NetworkConfig(hidden_sizes=(12, 8), layer_norm=True, dueling=True, atoms=7, noisy=True),
}


@cache
def seen() -> NDArray[np.float32]:
    """Observations of flights with random actions, and of one that the heuristic lands, [N, 8]."""
    rng, heuristic = np.random.default_rng(0), HeuristicPolicy()
    found = []
    for seed in range(8):
        env = LanderEnv(max_episode_steps=1000)
        observation, _ = env.reset(seed=seed)
        ended = False
        while not ended:
            found.append(observation)
            lands = seed == 0
            action = heuristic.act(observation[None])[0] if lands else rng.integers(4)
            observation, _, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
    return np.array(found)


def random_params(config: NetworkConfig) -> dict[str, NDArray[np.float32]]:
    layout = Layout(8, 4, config)
    rng = np.random.default_rng(1)
    return layout.split(rng.normal(0, 0.5, layout.num_params).astype(np.float32))


def file_of(
    tensors: dict[str, NDArray[Any]], described: dict[str, Any] | None, **texts: str
) -> bytes:
    metadata = {"format_version": "2", "env_id": "LunarLander-v3", "preset": "made up"}
    if described is not None:
        metadata["network"] = json.dumps(described)
    return save(tensors, metadata | texts)


def computed(files: list[bytes], observations: NDArray[np.float32]) -> list[dict[str, Any]]:
    request = {"module": encoded(MODULE), "files": [encoded(file) for file in files]}
    return in_node("values.js", "ofNetworks", {**request, "observations": observations.tolist()})


def complaints(contents: list[bytes]) -> list[str | None]:
    request = {"module": encoded(MODULE), "files": [encoded(content) for content in contents]}
    return in_node("values.js", "complaints", request)


def values_of(answer: dict[str, Any]) -> NDArray[np.float32]:
    return np.array([row["values"] for row in answer["rows"]], np.float32)


def test_values_of_every_kind_of_network_are_those_in_python(tmp_path):
    observations = seen()[::5]
    files = {name: file_of(random_params(config), asdict(config)) for name, config in KINDS.items()}
    for (name, content), answer in zip(
        files.items(), computed(list(files.values()), observations), strict=True
    ):
        path = tmp_path / f"{name}.safetensors"
        path.write_bytes(content)
        expected = load_weights(path).policy.values(observations)
        assert_allclose(values_of(answer), expected, rtol=2e-5, atol=2e-5, err_msg=name)
        assert answer["layerSizes"] == [8, *KINDS[name].hidden_sizes, 4]
        assert answer["name"] == "made up"


def test_values_have_the_bits_of_the_kernel_without_fused_arithmetic(tmp_path):
    observations = seen()[::5]
    np.save(tmp_path / "observations.npy", observations)
    kinds = [config for config in KINDS.values() if config.activation == "relu"]
    files = [file_of(random_params(config), asdict(config)) for config in kinds]
    for number, content in enumerate([*files, ACE.read_bytes()]):
        (tmp_path / f"{number}.safetensors").write_bytes(content)
    subprocess.run(
        [sys.executable, "-c", BASELINE, tmp_path],
        env=os.environ | {"TOUCHDOWN_SIMD": "baseline"},
        check=True,
    )
    for number, answer in enumerate(computed([*files, ACE.read_bytes()], observations)):
        expected = np.load(tmp_path / f"{number}.safetensors.npy")
        assert values_of(answer).tobytes() == expected.tobytes(), number


def test_activations_are_those_of_the_hidden_layers_after_the_nonlinearity():
    config = KINDS["plain"]
    tensors = random_params(config)
    observations = seen()[::50]
    (answer,) = computed([file_of(tensors, asdict(config))], observations)
    features = observations
    for number, size in enumerate(config.hidden_sizes):
        weight, bias = tensors[f"layers.{number}.weight"], tensors[f"layers.{number}.bias"]
        features = np.maximum(features @ weight.T + bias, 0)
        given = np.array([row["activations"][number] for row in answer["rows"]])
        assert given.shape == (len(observations), size)
        assert_allclose(given, features, rtol=1e-5, atol=1e-5)
    assert {len(row["activations"]) for row in answer["rows"]} == {2}


def test_the_greedy_action_is_the_first_of_the_highest_values():
    tensors = {"layers.0.weight": np.zeros((4, 8), np.float32)}
    tensors["layers.0.bias"] = np.array([1, 3, 3, 2], np.float32)
    (answer,) = computed([file_of(tensors, {"hidden_sizes": []})], seen()[:3])
    assert [row["action"] for row in answer["rows"]] == [1, 1, 1]


def test_controllers_act_as_in_python():
    observations = seen()
    chosen = in_node("values.js", "ofControllers", {"observations": observations.tolist()})
    policies = {
        "heuristic": HeuristicPolicy(),
        "signed": PIDPolicy(shipped_pid("signed")),
        "absolute": PIDPolicy(shipped_pid("absolute")),
    }
    for name, policy in policies.items():
        assert chosen[name] == policy.act(observations).tolist(), name
        assert set(chosen[name]) == {0, 1, 2, 3}


def test_settings_that_a_file_leaves_out_have_pythons_defaults():
    content = file_of(random_params(NetworkConfig()), {})
    assert complaints([content]) == [None]
    assert computed([content], seen()[:1])[0]["layerSizes"] == [8, *NetworkConfig().hidden_sizes, 4]


def test_a_file_says_by_what_its_rewards_were_scaled():
    tensors, network = random_params(KINDS["plain"]), asdict(KINDS["plain"])
    files = [file_of(tensors, network), file_of(tensors, network, reward_scale="0.01")]
    answers = computed([*files, ACE.read_bytes()], seen()[:1])
    assert [answer["rewardScale"] for answer in answers] == [1, 0.01, 0.1]


def test_a_wrong_file_is_refused_in_one_line():
    config = KINDS["all"]
    tensors, network = random_params(config), asdict(config)
    good = file_of(tensors, network)
    bias = tensors["value.bias"]
    wrong = {
        "not a safetensors file: it has 3 bytes": good[:3],
        "not a safetensors file: its header would have": good[:100],
        "is not within it": good[:-1],
        "its header is not JSON": good[:8] + b"!" + good[9:],
        'format_version = "1": must be "2"': file_of(tensors, network, format_version="1"),
        'env_id = "CartPole-v1": must be "LunarLander-v3"': file_of(
            tensors, network, env_id="CartPole-v1"
        ),
        "it describes no network": file_of(tensors, None),
        "not JSON": file_of(tensors, network, network="{"),
        "not a JSON object": file_of(tensors, network, network="3"),
        'unknown field "depth"': file_of(tensors, network | {"depth": 3}),
        "hidden_sizes = [0]": file_of(tensors, network | {"hidden_sizes": [0]}),
        "has 17 layers, must be at most 16": file_of(tensors, network | {"hidden_sizes": [1] * 17}),
        "atoms = 1": file_of(tensors, network | {"atoms": 1}),
        "v_min = 10: must be below v_max = 10": file_of(tensors, network | {"v_min": 10}),
        "value.bias is F32[3], must be F32[7]": file_of(
            tensors | {"value.bias": bias[:3]}, network
        ),
        "value.bias is F64[7]": file_of(
            tensors | {"value.bias": bias.astype(np.float64)}, network
        ),
        "value.bias has numbers that are not finite": file_of(
            tensors | {"value.bias": bias * np.float32("nan")}, network
        ),
        "value.bias_sigma: missing": file_of(
            {name: tensor for name, tensor in tensors.items() if name != "value.bias_sigma"},
            network,
        ),
        "extra: is not part of the network": file_of(tensors | {"extra": bias}, network),
        'reward_scale = "0": must be a number above 0': file_of(
            tensors, network, reward_scale="0"
        ),
        'reward_scale = "-1"': file_of(tensors, network, reward_scale="-1"),
        'reward_scale = "nan"': file_of(tensors, network, reward_scale="nan"),
        'reward_scale = "Infinity"': file_of(tensors, network, reward_scale="Infinity"),
    }  # fmt: skip
    for said, expected in zip(complaints(list(wrong.values())), wrong, strict=True):
        assert said is not None, expected
        assert expected in said
        assert "\n" not in said
    assert complaints([good]) == [None]


def test_no_single_wrong_value_in_the_description_stops_the_engine():
    config = KINDS["all"]
    tensors, network = random_params(config), asdict(config)
    changed = [file_of(tensors, other) for other in single_changes(network) if other is not None]
    said = complaints(changed)
    assert sum(text is not None for text in said) > 20
    assert not [text for text in said if text is not None and not text.startswith("Error: not a")]


def test_the_shipped_policy_acts_as_in_python_in_a_hundred_episodes():
    jobs = [{"policy": "ace", "seed": seed, "settings": {}} for seed in range(100)]
    request = {"module": encoded(MODULE), "weights": encoded(ACE), "jobs": jobs}
    policy = load_weights(ACE).policy
    same = []
    for episode in in_node("flights.js", "answer", request)["episodes"]:
        actions = np.frombuffer(b64decode(episode["actions"]), np.uint8)
        observations = np.frombuffer(b64decode(episode["observations"]), np.float32)
        same.append(policy.act(observations.reshape(-1, 8)[:-1]) == actions)
    # instruction sets round differently, which decides where two values are equal but for that
    assert np.concatenate(same).mean() > 0.9995
    assert len(np.concatenate(same)) > 15_000
