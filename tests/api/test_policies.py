from pathlib import Path

import jax
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from saved_policies import save_model
from touchdown.agents.networks import QNetwork
from touchdown.api.policies import find_policy
from touchdown.config.config import Config
from touchdown.config.sections import NetworkConfig
from touchdown.core.errors import UserError
from touchdown.core.starts import VALIDATION_STARTS
from touchdown.evaluation.evaluator import Evaluator
from touchdown.lander import engine as engines
from touchdown.policies import lookup
from touchdown.policies.facts import WeightsFacts
from touchdown.runs import folder as folders

CONFIG = Config(env_id="CartPole-v1", network=NetworkConfig(hidden_sizes=()))
NETWORK = QNetwork(4, 2, CONFIG.network)
OBSERVATIONS = np.random.default_rng(0).normal(size=(50, 4)).astype(np.float32)
LANDER = "LunarLander-v3"
SB3 = Path(__file__).parents[1] / "policies" / "foreign" / "sb3"


def weights(path: Path, seed: int) -> np.ndarray:
    """Write a policy and return its actions."""
    params = np.asarray(NETWORK.init(jax.random.key(seed)))
    save_model(path, NETWORK, params, WeightsFacts(), CONFIG)
    return NETWORK.policy(params).act(OBSERVATIONS)


@pytest.fixture
def shipped(tmp_path, monkeypatch) -> Path:
    folder = tmp_path / "weights"
    folder.mkdir()
    monkeypatch.setattr(lookup, "SHIPPED", folder)
    return folder


def test_a_shipped_policy_is_found_by_its_name(shipped, tmp_path):
    actions = weights(shipped / "ace.safetensors", seed=0)
    policy = find_policy("ace", tmp_path / "runs", None)
    assert (policy.name, policy.env_id) == ("ace", "CartPole-v1")
    assert_array_equal(policy.policy.act(OBSERVATIONS), actions)


def test_a_run_takes_precedence_over_a_shipped_policy_of_its_name(shipped, tmp_path):
    decoy = weights(shipped / "ace.safetensors", seed=0)
    run = folders.create(tmp_path / "runs", CONFIG, "ace")
    actions = weights(run.best, seed=1)
    assert not np.array_equal(actions, decoy)
    policy = find_policy("ace", tmp_path / "runs", None)
    assert_array_equal(policy.policy.act(OBSERVATIONS), actions)


def test_a_folder_outside_the_runs_folder_does_not_hide_a_shipped_policy(
    shipped, tmp_path, monkeypatch
):
    weights(shipped / "ace.safetensors", seed=0)
    (tmp_path / "ace").mkdir()
    monkeypatch.chdir(tmp_path)
    assert find_policy("ace", Path("runs"), None).name == "ace"
    with pytest.raises(UserError, match="not a run, because it has no config"):
        find_policy("./ace", Path("runs"), None)


def test_a_name_cannot_lead_out_of_the_runs_folder(shipped, tmp_path):
    weights(tmp_path / "secret.safetensors", seed=0)
    assert shipped.is_dir()
    with pytest.raises(UserError, match=r"policy '\.\./secret': unknown"):
        find_policy("../secret", tmp_path / "runs", None)


def test_the_folder_of_shipped_policies_is_in_the_package():
    assert (lookup.SHIPPED / "README.md").is_file()


def test_a_stable_baselines_archive_is_a_policy_for_the_environment_given(tmp_path):
    policy = find_policy(SB3 / "dqn.zip", tmp_path, LANDER)
    assert (policy.name, policy.env_id) == ("dqn", "LunarLander-v3")
    assert policy.policy.act(np.zeros((2, 8), np.float32)).shape == (2,)
    with pytest.raises(UserError, match="the environment has observations of 4 and 2 actions"):
        find_policy(SB3 / "dqn.zip", tmp_path, "CartPole-v1")


@pytest.mark.parametrize("name", ["x.onnx", "x.zip", "x.toml", "x.safetensors", "random"])
def test_a_run_cannot_have_the_name_of_another_policy(tmp_path, name):
    with pytest.raises(UserError, match="is already the name of a policy"):
        folders.create(tmp_path, CONFIG, name)


def test_the_shipped_policy_lands_from_starts_that_did_not_choose_it():
    ace = lookup.load("ace")
    evaluator = Evaluator(ace.env_id, engine=engines.engine_in_use())
    results = evaluator.rollout(ace.policy, VALIDATION_STARTS[-40:])
    evaluator.close()
    assert {result.outcome for result in results} == {"landed"}
    assert np.mean([result.episode_return for result in results]) > 275


@pytest.mark.parametrize("env_id", ["CartPole-v1", "FrozenLake-v1"])
def test_a_policy_refuses_an_environment_that_is_not_its_own(tmp_path, env_id):
    for name in ("pid", "ace"):
        with pytest.raises(UserError, match=f"env_id = '{env_id}': policy '{name}' acts in Lunar"):
            find_policy(name, tmp_path, env_id)
    assert find_policy("random", tmp_path, env_id).env_id == env_id
    assert find_policy("pid", tmp_path, "touchdown/LunarLander-v3").env_id == LANDER


def test_a_policy_for_the_lander_acts_in_its_variants_too(tmp_path):
    windy = "touchdown/LunarLanderWindy-v3"
    for name in ("pid", "ace", "random"):
        assert find_policy(name, tmp_path, windy).env_id == windy
    of_wind = find_policy("pid", tmp_path, windy)
    for env_id in (LANDER, "touchdown/LunarLander-v3"):
        assert find_policy(of_wind, tmp_path, env_id).env_id == LANDER
    assert find_policy(of_wind, tmp_path, None).env_id == windy


def test_an_unknown_policy_is_answered_with_what_is_accepted(tmp_path):
    with pytest.raises(UserError, match=r"policy 'x\.gif': unknown; must be a run of .*\.onnx"):
        find_policy("x.gif", tmp_path, None)
    with pytest.raises(UserError, match=r"policy 'heuristik': unknown; did you mean heuristic\?"):
        find_policy("heuristik", tmp_path, None)
    with pytest.raises(UserError, match="policy '': unknown"):
        find_policy("", tmp_path, None)
