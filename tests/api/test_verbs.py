import io
from dataclasses import asdict, replace
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
import tomli_w
from gymnasium.envs.classic_control import CartPoleEnv
from rich.console import Console

import touchdown
from touchdown.cli import tables
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import TableConfig, TrainingConfig
from touchdown.core import files
from touchdown.envs import environment
from touchdown.envs.flight import load_flights
from touchdown.evaluation import table
from touchdown.figures import policy_map
from touchdown.figures.grid import grid_of
from touchdown.policies import baselines
from touchdown.policies import weights as policy_weights
from touchdown.runs.run import list_facts


def tiny(env_id: str = "LunarLander-v3", **training) -> Config:
    settings = {
        "episodes": 3,
        "validation_period": 50,
        "validation_episodes": 2,
        "final_validation_episodes": 2,
        "test_episodes": 2,
    }
    base = presets.preset("pilot")
    return replace(
        base,
        env_id=env_id,
        network=replace(base.network, hidden_sizes=(8,)),
        replay=replace(base.replay, min_size=50),
        training=TrainingConfig(**(settings | training)),
    )


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> touchdown.Run:
    return touchdown.train(tiny(), runs_dir=tmp_path_factory.mktemp("runs"))


def test_train_gives_a_finished_run_with_its_baselines(run):
    assert run.name == "pilot-0"
    assert run.status == "finished"
    content = files.read_json(run.folder.evaluation)
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
        "landing.gif",
        "landing.mp4",
    }
    recorded = load_flights(run.path / "flights.safetensors")
    assert {flight.policy for flight in recorded} == {"pilot-0", "pid"}


def test_evaluate_and_fly_tell_the_same_of_one_start(run):
    evaluation = touchdown.evaluate(run, episodes=2)
    assert run.evaluation is not None
    assert evaluation.episodes == run.evaluation.episodes
    flight = touchdown.fly(run, seed=1)
    assert flight.episode_return == pytest.approx(evaluation.episodes[1].episode_return)
    assert flight.outcome == evaluation.episodes[1].outcome
    assert flight.fuel == pytest.approx(evaluation.episodes[1].fuel)


def test_a_pilot_can_be_named_in_every_way(run):
    weights = run.folder.best
    by_run = touchdown.evaluate(run, episodes=1).episodes
    assert touchdown.evaluate(run.policy, episodes=1).episodes == by_run
    assert touchdown.evaluate(str(weights), episodes=1).episodes == by_run
    assert touchdown.evaluate(weights, episodes=1).episodes == by_run
    assert touchdown.evaluate("pilot-0", episodes=1, runs_dir=run.path.parent).episodes == by_run
    assert touchdown.evaluate(str(run.path), episodes=1).episodes == by_run


def test_fly_writes_a_film_where_it_is_told(tmp_path):
    touchdown.fly("random", seed=3, out=tmp_path / "pilot.gif")
    assert (tmp_path / "pilot.gif").read_bytes().startswith(b"GIF89a")


def test_fly_needs_a_screen_for_a_window(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(touchdown.UserError) as said:
        touchdown.fly("pid", out="window")
    assert "\n" not in str(said.value)


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


def test_a_finished_run_gone_on_with_gains_no_file(run):
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


def test_a_broken_run_is_listed_beside_the_whole_ones(tmp_path):
    touchdown.train(tiny(episodes=1, test_episodes=0), runs_dir=tmp_path, name="whole")
    touchdown.train(tiny(episodes=1, test_episodes=0), runs_dir=tmp_path, name="half")
    (tmp_path / "half" / "episodes.jsonl").write_text("{}\n")
    whole, half = list_facts(tmp_path)
    assert (whole["name"], whole["status"]) == ("whole", "finished")
    assert (half["name"], half["status"]) == ("half", "broken")
    assert "line 1: episode: missing" in half["error"]
    console = Console(record=True, width=120, file=io.StringIO())
    console.print(tables.runs_table([whole, half]))
    text = console.export_text()
    assert "finished" in text
    assert "broken" in text


def test_a_run_without_weights_yet_says_so(tmp_path):
    from touchdown.runs import folder as folders  # noqa: PLC0415

    folders.create(tmp_path, tiny(), "young")
    with pytest.raises(touchdown.UserError, match="run 'young': no weights yet"):
        touchdown.evaluate("young", runs_dir=tmp_path)


def test_runs_are_listed_oldest_first(tmp_path):
    for name in ("b", "a"):
        touchdown.train(tiny("CartPole-v1", episodes=1), name=name, runs_dir=tmp_path)
    assert [run.name for run in touchdown.list_runs(tmp_path)] == ["b", "a"]


@pytest.mark.parametrize("env_id", ["Acrobot-v1", "MountainCar-v0"])
def test_other_worlds_train_test_and_are_filmed(tmp_path, env_id):
    run = touchdown.train(tiny(env_id, episodes=1), runs_dir=tmp_path)
    assert run.evaluation is not None
    assert run.evaluation.env_id == env_id
    assert run.evaluation.summary.threshold == {"Acrobot-v1": -100, "MountainCar-v0": -110}[env_id]
    assert (run.path / "landing.gif").is_file()


def test_tuning_writes_gains_that_fly(tmp_path):
    out = tmp_path / "gains.toml"
    best = touchdown.tune_pid(starts=2, tolerance=0.9, out=out)
    assert baselines.read_pid(out) == best
    assert out.read_text().startswith("# touchdown tune pid --rule signed --starts 2 --seed 0\n")
    assert touchdown.evaluate(out, episodes=1).name == "gains"


def test_tuning_begins_from_the_gains_that_it_is_given(tmp_path, monkeypatch):
    tried = []

    def fly(_evaluator, policy, starts):
        tried.append(policy.config)
        return [SimpleNamespace(episode_return=0.0) for _ in starts]

    monkeypatch.setattr("touchdown.evaluation.evaluator.Evaluator.rollout", fly)
    gains = replace(baselines.shipped_pid(), kp_vertical=-3.25)
    file = tmp_path / "gains.toml"
    file.write_text(tomli_w.dumps(asdict(gains)))
    touchdown.tune_pid(starts=1, tolerance=0.9, begin=file, rule="absolute")
    assert tried[0] == replace(gains, rule="absolute")
    tried.clear()
    touchdown.tune_pid(starts=1, tolerance=0.9, begin=gains)
    assert tried[0] == gains


def test_the_shipped_gains_are_those_of_the_better_rule():
    assert baselines.shipped_pid() in (
        baselines.shipped_pid("signed"),
        baselines.shipped_pid("absolute"),
    )
    assert baselines.shipped_pid("absolute").rule == "absolute"
    assert baselines.shipped_pid("signed").rule == "signed"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('rule = "up"\n', "rule = 'up': must be one of absolute, signed"),
        ("dead_band = -1\n", "dead_band = -1"),
        ("kp = 1\n", "unknown field 'kp'; known: rule, kp_vertical"),
        ("kp_vertical = 'big'\n", "kp_vertical = 'big': must be a number"),
        ('rule = "signed"\n', "kp_vertical, ki_vertical, kp_angle, kd_angle, dead_band: missing"),
    ],
)
def test_bad_gains_are_refused(tmp_path, text, said):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(touchdown.UserError, match=r"bad\.toml") as refused:
        baselines.read_pid(path)
    assert said in str(refused.value)


def test_chance_flies_a_start_alike_whoever_flies_beside():
    three = touchdown.evaluate("random", episodes=3, env_id="CartPole-v1").episodes
    assert (
        three[2:] == touchdown.evaluate("random", episodes=1, seed=2, env_id="CartPole-v1").episodes
    )
    flight = touchdown.fly("random", seed=2, env_id="CartPole-v1")
    assert flight.steps == three[2].steps


def test_chance_takes_every_action_equally_often():
    observations = np.random.default_rng(0).normal(size=(4_000, 8)).astype(np.float32)
    counts = np.bincount(baselines.RandomPolicy(4).act(observations), minlength=4)
    assert counts == pytest.approx(1_000, abs=100)  # 3.7 standard deviations


def test_a_world_without_a_threshold_counts_no_episode_as_solved():
    gymnasium.register("Unsolvable-v0", CartPoleEnv, max_episode_steps=20)
    try:
        evaluation = touchdown.evaluate("random", episodes=2, env_id="Unsolvable-v0")
    finally:
        gymnasium.registry.pop("Unsolvable-v0")
    assert evaluation.summary.threshold is None
    assert evaluation.summary.share_solved is None
    console = Console(record=True, width=120, file=io.StringIO())
    console.print(table.evaluation_table([evaluation]))
    assert "share" not in console.export_text()


def test_the_stock_heuristic_flies_as_gymnasium_flies_it():
    from gymnasium.envs.box2d.lunar_lander import heuristic  # noqa: PLC0415

    env = gymnasium.make("LunarLander-v3")
    observation, _ = env.reset(seed=5)
    total, ended = 0.0, False
    while not ended:
        observation, reward, terminated, truncated, _ = env.step(
            heuristic(env.unwrapped, observation)
        )
        total += float(reward)
        ended = terminated or truncated
    env.close()
    flown = touchdown.evaluate("heuristic", episodes=1, seed=5).episodes[0]
    assert flown.episode_return == pytest.approx(total, abs=1e-9)


def test_weights_of_another_network_are_refused(tmp_path):
    from safetensors.numpy import save_file  # noqa: PLC0415

    path = tmp_path / "odd.safetensors"
    save_file({"w": np.zeros(3, np.float32)}, path)
    with pytest.raises(touchdown.UserError, match="format_version = None"):
        policy_weights.load_weights(path)
    save_file({"w": np.zeros(3, np.float32)}, path, {"format_version": "2"})
    with pytest.raises(touchdown.UserError, match="not a policy's weights"):
        policy_weights.load_weights(path)


def test_weights_for_another_world_than_they_say_are_refused(run, tmp_path):
    from safetensors.numpy import save_file  # noqa: PLC0415

    tensors, metadata = files.read_tensors(run.folder.best)
    path = tmp_path / "cart.safetensors"
    save_file(tensors, path, metadata | {"env_id": "CartPole-v1"})
    with pytest.raises(
        touchdown.UserError,
        match=r"for env_id 'CartPole-v1': layers.0.weight is .*\(8, 8\), must be .*\(8, 4\)",
    ):
        policy_weights.load_weights(path)


def test_gains_that_cannot_be_saved_are_said(tmp_path, monkeypatch):
    def full(*_args) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("touchdown.core.files.write_atomic", full)
    with pytest.raises(touchdown.UserError, match=r"kp_vertical=.*No space left on device"):
        touchdown.tune_pid(starts=1, tolerance=0.9, out=tmp_path / "pid.toml")


def test_being_out_of_memory_says_what_to_make_smaller(tmp_path, monkeypatch):
    def no_memory(*_args, **_options) -> None:
        raise MemoryError("Unable to allocate 76.3 GiB")

    monkeypatch.setattr("touchdown.training.trainer.make_agent", no_memory)
    with pytest.raises(touchdown.UserError, match=r"76.3 GiB.*a smaller capacity, batch_size"):
        touchdown.train(tiny(), runs_dir=tmp_path)


def lake(**changes) -> Config:
    base = presets.preset("tabular-q")
    settings = {
        "max_env_steps": 300,
        "validation_period": 100,
        "validation_episodes": 2,
        "final_validation_episodes": 2,
        "test_episodes": 2,
    }
    return replace(base, training=replace(base.training, **settings), **changes)


def test_what_a_table_learnt_of_a_lake_is_drawn_and_printed_as_a_map(tmp_path):
    console = Console(record=True, width=120, file=io.StringIO())
    run = touchdown.train(lake(), runs_dir=tmp_path, console=console)
    assert run.path / "policy.png" in run.pictures
    assert (run.path / "policy.png").read_bytes().startswith(b"\x89PNG")
    text = console.export_text()
    world = environment.make_env("FrozenLake-v1")
    grid = grid_of(world.env)
    world.env.close()
    printed = text.partition("the policy learnt:\n")[2].splitlines()[:4]
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
        (lake(env_id="CliffWalking-v1", table=TableConfig(bins=(4,))), "must stay .. in a world"),
        (
            replace(presets.preset("value-iteration"), env_id="CartPole-v1"),
            "env_id 'CartPole-v1': its model is not known",
        ),
        (lake(env_id="Blackjack-v1"), "its observation space is Tuple"),
    ],
)
def test_settings_that_do_not_fit_their_world_are_refused_before_a_folder_is_made(
    tmp_path, config, said
):
    with pytest.raises(touchdown.UserError, match=said) as refused:
        touchdown.train(config, runs_dir=tmp_path / "runs")
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())
