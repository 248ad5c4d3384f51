import pickle
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from torch_files import saved, saved_state
from touchdown.core.errors import UserError
from touchdown.policies.foreign.torch_file import read_torch

LANDER, CART = "LunarLander-v3", "CartPole-v1"
OBSERVATIONS = np.random.default_rng(1).normal(size=(100, 4)).astype(np.float32)


def layers(prefix: str, *sizes: int) -> dict[str, np.ndarray]:
    """Random layers of these sizes, numbered as in a Sequential with activations."""
    rng = np.random.default_rng(0)
    arrays: dict[str, np.ndarray] = {}
    for index, (fan_in, fan_out) in enumerate(pairwise(sizes)):
        arrays[f"{prefix}{2 * index}.weight"] = rng.normal(size=(fan_out, fan_in))
        arrays[f"{prefix}{2 * index}.bias"] = rng.normal(size=fan_out)
    return {name: array.astype(np.float32) for name, array in arrays.items()}


def outputs(arrays: dict[str, np.ndarray], activation) -> np.ndarray:
    """What the layers give for the observations, worked out by hand."""
    *hidden, last = zip(*[iter(arrays.values())] * 2, strict=True)
    result = OBSERVATIONS
    for weight, bias in hidden:
        result = activation(result @ weight.T + bias)
    return result @ last[0].T + last[1]


def relu(x: np.ndarray) -> np.ndarray:
    return np.maximum(x, 0)


def test_a_dqn_of_cleanrl_takes_the_action_with_the_largest_value(tmp_path):
    arrays = layers("network.", 4, 120, 84, 2)
    path = tmp_path / "dqn.cleanrl_model"
    path.write_bytes(saved_state(arrays))
    actions = read_torch(path, CART).act(OBSERVATIONS)
    assert_array_equal(actions, outputs(arrays, relu).argmax(1))
    assert len(set(actions.tolist())) == 2


def test_a_ppo_of_cleanrl_takes_the_most_probable_action(tmp_path):
    actor = layers("actor.", 4, 64, 64, 2)
    path = tmp_path / "ppo.pt"
    path.write_bytes(saved_state(layers("critic.", 4, 64, 64, 1) | actor))
    actions = read_torch(path, CART).act(OBSERVATIONS)
    assert_array_equal(actions, outputs(actor, np.tanh).argmax(1))
    assert (actions != outputs(actor, relu).argmax(1)).any()  # the decoy


def test_a_c51_of_cleanrl_takes_the_action_with_the_largest_mean(tmp_path):
    arrays = layers("network.", 4, 120, 84, 2 * 3)
    atoms = np.array([-10, 0, 10], np.float32)
    path = tmp_path / "c51.cleanrl_model"
    path.write_bytes(saved_state({"atoms": atoms} | arrays, entry="model_weights"))
    logits = outputs(arrays, relu).reshape(-1, 2, 3)
    weights = np.exp(logits - logits.max(2, keepdims=True))
    means = (weights / weights.sum(2, keepdims=True)) @ atoms
    assert_array_equal(read_torch(path, CART).act(OBSERVATIONS), means.argmax(1))


HOW = "; export it where it was trained, with torch.onnx.export(model, (torch.zeros(1, 4),), "


def refusal(path, data: bytes, env_id: str = CART) -> str:
    path.write_bytes(data)
    with pytest.raises(UserError) as said:
        read_torch(path, env_id)
    assert str(said.value).startswith(f"{path}: not weights of CleanRL's DQN, C51 or PPO: ")
    assert "\n" not in str(said.value)
    return str(said.value)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (saved_state(layers("fc", 4, 64, 2)), "it has fc0.bias, fc0.weight, fc2.bias, fc2.weight"),
        (saved_state(layers("network.", 4, 64, 64, 2)), "which do not say what is computed"),
        (saved_state({}), "it has no arrays, which do not say"),
        (saved(b"\x80\x02c__main__\nNet\n)R."), "names '__main__.Net', which is not needed"),
        (pickle.dumps({"a": 1}), "it is not a file of torch.save from PyTorch 1.6 or later, but"),
        (b"", "it is not a file of torch.save"),
        (b"PK\x03\x04", "not a complete zip archive"),
        (
            saved_state(
                {"atoms": np.array([0, 1, 5], np.float32)} | layers("network.", 4, 120, 84, 6),
                entry="model_weights",
            ),
            "its atoms are not equally spaced",
        ),
        (
            saved_state(
                layers("network.", 4, 120, 84, 2)
                | {"network.0.bias": np.full(120, np.nan, np.float32)}
            ),
            "layers.0.bias has 120 of 120 numbers that are not finite",
        ),
    ],
)
def test_another_file_is_refused_with_the_way_to_onnx(tmp_path, data, said):
    message = refusal(tmp_path / "m.pth", data)
    assert said in message
    assert HOW in message


def test_a_policy_for_another_environment_is_refused_with_the_flag_that_names_it(tmp_path):
    data = saved_state(layers("network.", 4, 120, 84, 2))
    said = refusal(tmp_path / "dqn.cleanrl_model", data, LANDER)
    assert "it takes 4 numbers and gives 2, for 2 actions; the environment has obs" in said
    assert "set it with --env-id" in said
