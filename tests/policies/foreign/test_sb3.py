import io
import json
import re
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from touchdown.core.errors import UserError
from touchdown.policies.foreign.archive import Archive
from touchdown.policies.foreign.sb3 import read_sb3
from touchdown.policies.foreign.sb3_facts import read_facts
from touchdown.policies.foreign.torch_state import read_state

SAVED = Path(__file__).parent / "sb3"  # by Stable-Baselines3 itself; see make_sb3.py
ENV_ID = "LunarLander-v3"
OBSERVATIONS = np.random.default_rng(0).normal(size=(200, 8)).astype(np.float32)


def refusal(path: Path, env_id: str = ENV_ID) -> str:
    with pytest.raises(UserError) as said:
        read_sb3(path, env_id)
    assert "\n" not in str(said.value)
    return str(said.value)


def rewritten(
    path: Path,
    out: Path,
    change: Callable[[dict[str, Any]], object] = dict,
    **members: bytes | None,
) -> Path:
    """An archive with other facts in `data`, and other members; None leaves one out."""
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    data = json.loads(content["data"])
    change(data)
    content |= {"data": json.dumps(data).encode()} | {
        name.replace("_pth", ".pth"): value for name, value in members.items()
    }
    with zipfile.ZipFile(out, "w") as archive:
        for name, value in content.items():
            if value is not None:
                archive.writestr(name, value)
    return out


def renamed(path: Path, before: bytes, after: bytes) -> bytes:
    """The weights of an archive, some bytes of their names replaced."""
    with zipfile.ZipFile(io.BytesIO(zipfile.ZipFile(path).read("policy.pth"))) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, value in content.items():
            archive.writestr(name, value.replace(before, after))
    return file.getvalue()


@pytest.mark.parametrize("name", ["dqn", "qrdqn", "ppo", "a2c"])
def test_a_policy_acts_as_stable_baselines_said_it_does(name):
    expected = json.loads((SAVED / "actions.json").read_text())[name]
    assert len(set(expected)) > 2
    assert read_sb3(SAVED / f"{name}.zip", ENV_ID).act(OBSERVATIONS).tolist() == expected


def test_its_values_are_those_of_the_layers_worked_out_by_hand():
    state = read_state(Archive((SAVED / "ppo.zip").read_bytes()).read("policy.pth", 100_000))
    hidden = np.tanh(
        OBSERVATIONS @ state["mlp_extractor.policy_net.0.weight"].T
        + state["mlp_extractor.policy_net.0.bias"]
    )
    logits = hidden @ state["action_net.weight"].T + state["action_net.bias"]
    values = read_sb3(SAVED / "ppo.zip", ENV_ID).values(OBSERVATIONS)
    assert_allclose(values, logits, atol=1e-5)


def test_the_activation_in_plain_text_overrides_the_algorithms_default(tmp_path):
    """A2C's default is tanh; this archive says ReLU, and the decoy lacks that text."""

    def forget(facts: dict[str, Any]) -> None:
        del facts["policy_kwargs"]["activation_fn"]

    path = rewritten(SAVED / "a2c.zip", tmp_path / "tanh.zip", forget)
    expected = json.loads((SAVED / "actions.json").read_text())["a2c"]
    assert read_sb3(path, ENV_ID).act(OBSERVATIONS).tolist() != expected


def test_layers_shared_by_actor_and_critic_come_first(tmp_path):
    """Before 1.8, shared layers were in shared_net; here the only layer is, for the same policy."""
    policy = renamed(SAVED / "ppo.zip", b"tor.policy_net.", b"tor.shared_net.")
    path = rewritten(SAVED / "ppo.zip", tmp_path / "old.zip", policy_pth=policy)
    expected = json.loads((SAVED / "actions.json").read_text())["ppo"]
    assert read_sb3(path, ENV_ID).act(OBSERVATIONS).tolist() == expected


def setting(section: str, name: str, value: object) -> Callable[[dict[str, Any]], None]:
    def change(facts: dict[str, Any]) -> None:
        facts[section] = dict(facts[section]) | {name: value}

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            setting("policy_class", "__module__", "sbx.dqn.policies"),
            "it was saved by SBX, with weights as a pickle; pickles are never opened",
        ),
        (setting("policy_class", "__module__", "mine"), "its policy's class is from 'mine'; only"),
        (lambda facts: facts.pop("policy_class"), "from 'an unnamed module'"),
        (
            setting("action_space", ":type:", "<class 'gymnasium.spaces.box.Box'>"),
            "its action_space is gymnasium.spaces.box.Box, must be Gymnasium's Discrete",
        ),
        (
            setting("action_space", ":type:", "<class 'gym.spaces.MultiDiscrete'>"),
            "its action_space is gym.spaces.MultiDiscrete, must be Gymnasium's Discrete",
        ),
        (lambda facts: facts.pop("action_space"), "its action_space is None"),
        (setting("action_space", "start", "1"), "its actions do not start at 0"),
        (
            setting("action_space", "n", "5"),
            "for 5 actions; the environment has observations of 8 and 4 actions",
        ),
        (
            setting("observation_space", ":type:", "<class 'gymnasium.spaces.dict.Dict'>"),
            "is gymnasium.spaces.dict.Dict, must be Gymnasium's Box or Discrete",
        ),
        (
            setting("policy_kwargs", "activation_fn", "<class 'torch.nn.modules.activation.ELU'>"),
            "its activation is torch.nn.modules.activation.ELU, must be one of torch",
        ),
        (
            setting("policy_kwargs", "activation_fn", "<function f at 0x7f>"),
            "its activation is <function f at 0x7f>, must be one of",
        ),
        (
            setting("policy_kwargs", "features_extractor_class", "<class 'mine.Scale'>"),
            "its features extractor is mine.Scale, must be stable_baselines3",
        ),
    ],
)
def test_another_kind_of_policy_is_refused(tmp_path, change, said):
    assert said in refusal(rewritten(SAVED / "dqn.zip", tmp_path / "other.zip", change))


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (b"q_net.q_net.0", b"q_net.cnn_1.0", "layers that are not linear"),
        (b"q_net.q_net.2", b"q_net.q_net.3", "q_net.q_net has layers that are not linear"),
        (b"q_net.q_net.2.bias", b"q_net.q_net.2.gain", "layers that are not linear"),
        (b"q_net.q_net.", b"k_net.k_net.", "not those of DQN, QRDQN, PPO or A2C"),
        (b"q_net.q_net.0.weight", b"features_extractor.0", "a features extractor with weights"),
        (b"q_net.q_net.0.weight", b"lstm_actor.weight_hh", "it is recurrent"),
    ],
)
def test_weights_of_another_kind_of_network_are_refused(tmp_path, before, after, said):
    policy = renamed(SAVED / "dqn.zip", before, after)
    path = rewritten(SAVED / "dqn.zip", tmp_path / "other.zip", policy_pth=policy)
    assert said in refusal(path)


def test_an_actor_of_continuous_actions_is_refused(tmp_path):
    policy = renamed(SAVED / "ppo.zip", b"\x0e\0\0\0value_net.bias", b"\x07\0\0\0log_std")
    path = rewritten(SAVED / "ppo.zip", tmp_path / "other.zip", policy_pth=policy)
    assert "not those of DQN, QRDQN, PPO or A2C with discrete actions" in refusal(path)


def test_a_policy_for_another_environment_is_refused_with_the_flag_that_names_it():
    said = refusal(SAVED / "dqn.zip", "CartPole-v1")
    assert "it takes 8 numbers and gives 4, for 4 actions" in said
    assert "the environment has observations of 4 and 2 actions; set it with --env-id" in said


# --- observations that were normalised in training ---

NORMALISED = SAVED / "ppo_normalised" / "ppo.zip"
STATISTICS = SAVED / "ppo_normalised" / "statistics.pkl"


def test_a_policy_trained_with_vecnormalize_acts_as_it_did_with_its_statistics():
    expected = json.loads((SAVED / "actions.json").read_text())["ppo_normalised"]
    flown = read_sb3(NORMALISED, ENV_ID, str(STATISTICS))
    assert flown.act(OBSERVATIONS).tolist() == expected
    without = read_sb3(NORMALISED, ENV_ID, "none")  # the decoy
    assert np.count_nonzero(without.act(OBSERVATIONS) != expected) > 20


def test_a_policy_trained_with_vecnormalize_is_refused_without_its_statistics(tmp_path):
    """The archive alone shows it; a name near it only shows which file to pass."""
    path = tmp_path / "ppo_8_steps.zip"
    path.write_bytes(NORMALISED.read_bytes())
    assert "was trained with VecNormalize: pass --vecnormalize FILE, the file" in refusal(path)
    for steps in (16, 8):
        (tmp_path / f"ppo_vecnormalize_{steps}_steps.pkl").write_bytes(b"")
    near = tmp_path / "ppo_vecnormalize_8_steps.pkl"
    assert f"pass --vecnormalize {near}, the file" in refusal(path)


def test_a_policy_trained_without_vecnormalize_needs_no_statistics(tmp_path):
    """It is what PPO keeps where it normalises nothing; the file near it is another policy's."""

    def forget(facts: dict[str, Any]) -> None:
        facts["_last_original_obs"] = None

    (tmp_path / "vecnormalize.pkl").write_bytes(b"")
    path = rewritten(NORMALISED, tmp_path / "ppo.zip", forget)
    expected = read_sb3(NORMALISED, ENV_ID, "none").act(OBSERVATIONS)
    assert read_sb3(path, ENV_ID).act(OBSERVATIONS).tolist() == expected.tolist()


@pytest.mark.parametrize(
    ("data", "normalised"),
    [
        (b'{"_last_obs": {"a": 1}, "_last_original_obs": {"a": 1}}', True),
        (b'{"_last_obs": null, "_last_original_obs": {"a": 1}}', True),  # loaded and saved again
        (b'{"_last_obs": {"a": 1}, "_last_original_obs": null}', False),
        (b'{"_last_obs": null, "_last_original_obs": null}', None),  # never trained
        (b'{"_last_obs": {"a": 1}}', None),
    ],
)
def test_an_archive_of_ppo_shows_whether_its_training_normalised(data, normalised):
    assert read_facts(data).normalised is normalised


@pytest.mark.parametrize(
    "name",
    [
        "vec_normalize.pkl",
        "vecnormalize.pkl",
        "rl_model_vecnormalize_1000_steps.pkl",
        "LunarLander-v3/vecnormalize.pkl",
    ],
)
def test_a_dqn_near_statistics_is_refused_until_the_user_says_whether_they_are_its(tmp_path, name):
    path = tmp_path / "dqn.zip"
    path.write_bytes((SAVED / "dqn.zip").read_bytes())
    near = tmp_path / name
    near.parent.mkdir(exist_ok=True)
    near.write_bytes(STATISTICS.read_bytes())
    assert f"may have been trained with VecNormalize: pass --vecnormalize {near}" in refusal(path)
    expected = json.loads((SAVED / "actions.json").read_text())["dqn"]
    assert read_sb3(path, ENV_ID, "none").act(OBSERVATIONS).tolist() == expected
    assert read_sb3(path, ENV_ID, str(near)).act(OBSERVATIONS).tolist() != expected


@pytest.mark.parametrize(
    ("members", "said"),
    [
        ({"policy_pth": None}, "has no 'policy.pth'"),
        ({"data": None}, "has no 'data'"),
        ({"data": b"{"}, "not JSON"),
        ({"data": b"[" * 100_000}, "Expected `object`"),
        ({"data": b"[]"}, "Expected `object`, got `array`"),
        ({"data": b"{}"}, "its policy's class is from"),
        ({"data": b'{"policy_class": 3}'}, "Expected `object`, got `int` - at `$.policy_class`"),
        ({"policy_pth": b"\x80\x02"}, "not a complete zip archive"),
    ],
)
def test_a_broken_archive_is_refused(tmp_path, members, said):
    assert said in refusal(rewritten(SAVED / "dqn.zip", tmp_path / "broken.zip", **members))


def test_an_archive_cut_off_anywhere_is_refused(tmp_path):
    data = (SAVED / "dqn.zip").read_bytes()
    path = tmp_path / "cut.zip"
    for length in range(0, len(data), 97):
        path.write_bytes(data[:length])
        refusal(path)


def test_facts_that_would_become_gigabytes_are_skipped(tmp_path):
    """16 MB of empty lists, 16 KB on disk; as values they would take a gigabyte."""
    data = zipfile.ZipFile(SAVED / "dqn.zip").read("data").rstrip()
    bomb = data[:-1] + b', "bomb": [' + b"[]," * 5_000_000 + b"[]]}"
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data", bomb)
        archive.writestr("policy.pth", zipfile.ZipFile(SAVED / "dqn.zip").read("policy.pth"))
    assert (tmp_path / "bomb.zip").stat().st_size < 40_000
    tracemalloc.start()
    flown = read_sb3(tmp_path / "bomb.zip", ENV_ID)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 120e6
    assert (
        flown.act(OBSERVATIONS).tolist() == json.loads((SAVED / "actions.json").read_text())["dqn"]
    )


def test_numbers_that_json_does_not_have_are_skipped(tmp_path):
    data = zipfile.ZipFile(SAVED / "dqn.zip").read("data").rstrip()
    odd = data[:-1] + b', "a": NaN, "b": [-Infinity, Infinity], "c": "NaN \\" NaN"}'
    path = rewritten(SAVED / "dqn.zip", tmp_path / "odd.zip", data=odd)
    assert read_sb3(path, ENV_ID)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_weights_that_are_not_finite_are_refused(tmp_path, value):
    bias = read_state(zipfile.ZipFile(SAVED / "ppo.zip").read("policy.pth"))["action_net.bias"]
    wrong = bias.copy()
    wrong[1] = value
    policy = renamed(SAVED / "ppo.zip", bias.tobytes(), wrong.tobytes())
    path = rewritten(SAVED / "ppo.zip", tmp_path / "wrong.zip", policy_pth=policy)
    assert "layers.1.bias has 1 of 4 numbers that are not finite" in refusal(path)


def test_someone_elses_class_of_a_known_name_is_refused(tmp_path):
    for name in ("__main__.Tanh", "torch.nn.modules.activation.Tanh.Tanh"):
        change = setting("policy_kwargs", "activation_fn", f"<class '{name}'>")
        path = rewritten(SAVED / "a2c.zip", tmp_path / "own.zip", change)
        assert f"its activation is {name}, must be one of torch." in refusal(path)


def test_an_archive_that_is_too_large_is_not_read(tmp_path, monkeypatch):
    path = tmp_path / "huge.zip"
    with path.open("wb") as file:
        file.truncate((128 << 20) + 1)
    assert "has 134217729 bytes, must be at most 134217728" in refusal(path)
    bomb = tmp_path / "bomb.zip"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data", bytes(100_000))
    monkeypatch.setattr("touchdown.core.limits.ARCHIVE_FACTS_BYTES", 99_999)
    assert "'data' has 100000 bytes, must be at most 99999" in refusal(bomb)


def test_a_missing_file_or_a_folder_is_refused(tmp_path):
    assert "cannot be read: No such file" in refusal(tmp_path / "gone.zip")
    (tmp_path / "folder.zip").mkdir()
    assert re.search("cannot be read: Is a directory", refusal(tmp_path / "folder.zip"))
