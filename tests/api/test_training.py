import io
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

import touchdown
from small_configs import lake, tiny
from touchdown.config import presets
from touchdown.config.sections import TableConfig
from touchdown.core import files
from touchdown.envs import environment
from touchdown.envs.flight import load_flights
from touchdown.figures import policy_map
from touchdown.figures.grid import grid_of


def test_train_gives_a_finished_run_with_its_baselines(run):
    assert run.name == "pilot-0"
    assert run.status == "finished"
    content = json.loads(run.folder.evaluation.read_text())
    assert [entry["name"] for entry in content["pilots"]] == [
        "pilot-0",
        "pid",
        "heuristic",
        "random",
    ]
    for entry in content["pilots"]:
        assert [episode["seed"] for episode in entry["episodes"]] == [0, 1]
        assert sum(entry["summary"]["outcomes"].values()) == pytest.approx(1)
    assert {path.name for path in run.pictures} == {
        "learning-curve.png",
        "flights.png",
        "flight.gif",
        "flight.mp4",
    }
    recorded = load_flights(run.path / "flights.safetensors")
    assert {flight.policy for flight in recorded} == {"pilot-0", "pid"}


def test_a_run_that_lost_a_picture_draws_it_again_without_training(run):
    before = run.folder.episodes.read_bytes(), run.folder.evaluation.read_bytes()
    curve = run.path / "learning-curve.png"
    drawn = curve.read_bytes()
    curve.unlink()
    assert run.status == "unfinished"
    again = touchdown.resume("pilot-0", runs_dir=run.path.parent)
    assert again.status == "finished"
    assert curve.read_bytes() == drawn
    assert (run.folder.episodes.read_bytes(), run.folder.evaluation.read_bytes()) == before


def test_the_right_to_write_is_held_until_the_last_picture(tmp_path, monkeypatch):
    refusals: list[str] = []

    def try_to_resume(*_args, **_options) -> None:
        with pytest.raises(touchdown.UserError) as refused:
            touchdown.resume("pilot-0", runs_dir=tmp_path)
        refusals.append(str(refused.value))

    monkeypatch.setattr("touchdown.figures.curve.save_learning_curve", try_to_resume)
    touchdown.train(tiny(test_episodes=0), runs_dir=tmp_path)
    assert refusals == ["run 'pilot-0': another process is training it"]


def test_settings_are_given_by_name(tmp_path):
    run = touchdown.train(
        lake(), runs_dir=tmp_path, name="mine", seed=3, learning_rate=0.5, env_id="FrozenLake8x8-v1"
    )
    config = touchdown.show("mine", tmp_path).config
    assert (config.seed, config.learning.learning_rate) == (3, 0.5)
    assert config.env_id == run.config.env_id == "FrozenLake8x8-v1"
    assert config.training == lake().training


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ({"learning_rat": 1e-3}, "learning_rat: unknown setting; did you mean learning_rate?"),
        ({"gamma": 2}, "gamma = 2.0: must be from 0 to 1"),
        ({"seed": -1}, "seed = -1: must be from 0 to 4294967295"),
    ],
)
def test_a_setting_that_is_refused_leaves_no_folder(tmp_path, setting, said):
    with pytest.raises(touchdown.UserError) as refused:
        touchdown.train("pilot", runs_dir=tmp_path / "runs", **setting)
    assert str(refused.value) == said
    assert not list(tmp_path.iterdir())


def test_a_script_is_silent_unless_it_asks_for_progress(run, capsys):
    touchdown.resume(run)
    touchdown.evaluate(run, episodes=1)
    assert capsys.readouterr().out == ""
    touchdown.resume(run, progress=True)
    assert "pilot-0: finished already" in capsys.readouterr().out
    console = Console(record=True, width=120, file=io.StringIO())
    touchdown.resume(run, console=console, progress=False)
    assert console.export_text() == ""


def test_resuming_a_finished_run_adds_no_file(run):
    before = {path for path in run.path.rglob("*") if path.is_file()}
    touchdown.resume("pilot-0", runs_dir=run.path.parent)
    assert {path for path in run.path.rglob("*") if path.is_file()} == before


def test_a_finished_run_that_lost_its_weights_chooses_them_again(tmp_path):
    run = touchdown.train(tiny(test_episodes=0), runs_dir=tmp_path)
    weights, _ = files.read_tensors(run.folder.best)
    run.folder.best.unlink()
    touchdown.resume(run.name, runs_dir=tmp_path)
    again, _ = files.read_tensors(run.folder.best)
    assert all(np.array_equal(again[name], weights[name]) for name in weights)


@pytest.mark.parametrize(
    "env_id", [pytest.param("Acrobot-v1", marks=pytest.mark.slow), "MountainCar-v0"]
)
def test_other_environments_train_test_and_are_filmed(tmp_path, env_id):
    run = touchdown.train(tiny(env_id, episodes=1), runs_dir=tmp_path)
    assert run.evaluation is not None
    assert run.evaluation.env_id == env_id
    assert run.evaluation.summary.threshold == {"Acrobot-v1": -100, "MountainCar-v0": -110}[env_id]
    assert (run.path / "flight.gif").is_file()


def test_running_out_of_memory_says_what_to_make_smaller(tmp_path, monkeypatch):
    def no_memory(*_args, **_options) -> None:
        raise MemoryError("Unable to allocate 76.3 GiB")

    monkeypatch.setattr("touchdown.training.trainer.make_agent", no_memory)
    with pytest.raises(touchdown.UserError, match=r"76.3 GiB.*a smaller capacity, batch_size"):
        touchdown.train(tiny(), runs_dir=tmp_path)


def test_the_policy_of_a_table_is_drawn_and_printed_as_a_map(tmp_path):
    console = Console(record=True, width=120, file=io.StringIO())
    run = touchdown.train(lake(), runs_dir=tmp_path, console=console)
    assert run.path / "policy.png" in run.pictures
    assert (run.path / "policy.png").read_bytes().startswith(b"\x89PNG")
    text = console.export_text()
    env, _ = environment.make_env("FrozenLake-v1")
    grid = grid_of(env)
    env.close()
    printed = text.partition("learned policy:\n")[2].splitlines()[:4]
    q = files.read_tensors(run.folder.best)[0]["q"]
    assert printed == policy_map.policy_text(grid, q).splitlines()
    assert printed[1][2] == printed[1][6] == "H"
    assert printed[3][6] == "G"


def test_a_run_that_lost_its_map_draws_it_again(tmp_path):
    run = touchdown.train(lake(), runs_dir=tmp_path)
    drawn = (run.path / "policy.png").read_bytes()
    (run.path / "policy.png").unlink()
    touchdown.resume(run.name, runs_dir=tmp_path)
    assert (run.path / "policy.png").read_bytes() == drawn


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (lake(env_id="CartPole-v1"), r"bins = \(\): must be 4 numbers"),
        (
            lake(env_id="CliffWalking-v1", table=TableConfig(bins=(4,))),
            "must be .. for an environment",
        ),
        (
            replace(presets.preset("value-iteration"), env_id="CartPole-v1"),
            "env_id 'CartPole-v1': its model is not known",
        ),
        (lake(env_id="Blackjack-v1"), "its observation space is Tuple"),
    ],
)
def test_settings_that_do_not_fit_their_environment_are_refused_before_a_folder_is_made(
    tmp_path, config, said
):
    with pytest.raises(touchdown.UserError, match=said) as refused:
        touchdown.train(config, runs_dir=tmp_path / "runs")
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())
