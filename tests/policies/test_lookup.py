import pickle
from pathlib import Path

import pytest

from touchdown.api.policies import find_policy
from touchdown.core.errors import UserError
from touchdown.policies import lookup, names

SB3 = Path(__file__).parent / "foreign" / "sb3"
LANDER = "LunarLander-v3"


def refusal(name: str, vecnormalize: str | None = None) -> str:
    with pytest.raises(UserError, match=r"^[^\n]*$") as said:
        find_policy(name, Path("runs"), LANDER, vecnormalize)
    return str(said.value)


@pytest.mark.parametrize("suffix", names.OTHER_FILES)
def test_a_file_of_another_kind_is_named_with_the_way_to_fly_it(tmp_path, suffix):
    path = tmp_path / f"model{suffix}"
    path.write_bytes(pickle.dumps({}))
    assert refusal(str(path)) == (
        f"policy '{path}': is {names.OTHER_FILES[suffix]}; export the network to ONNX where it "
        "was trained, and use the .onnx file"
    )


@pytest.mark.parametrize("suffix", names.TORCH_FILES)
def test_a_file_of_pytorch_is_a_policy_and_not_a_run(tmp_path, suffix):
    path = tmp_path / f"missing{suffix}"
    assert refusal(str(path)) == f"{path}: cannot be read: No such file or directory"


def test_statistics_are_only_for_an_archive_of_stable_baselines():
    said = "vecnormalize = 'none': must be None for {!r}; only a .zip of Stable-Baselines3 has"
    for name in ("pid", "ace", "pilot-0", "model.onnx"):
        assert said.format(name) in refusal(name, "none")
    path = str(SB3 / "ppo_normalised" / "ppo.zip")
    statistics = str(SB3 / "ppo_normalised" / "statistics.pkl")
    assert lookup.load(path, LANDER, statistics).name == "ppo"


@pytest.mark.parametrize("suffix", [".toml", ".safetensors", ".onnx", ".zip", ".pth"])
def test_a_device_is_not_a_policy_whatever_its_name(tmp_path, suffix):
    path = tmp_path / f"m{suffix}"
    path.symlink_to("/dev/zero")
    assert refusal(str(path)) == f"{path}: is a device, must be a regular file"
