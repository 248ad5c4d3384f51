import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import save
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from checkpoints import read_state, write_state
from touchdown.agents.dqn import DQNAgent
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    TrainingConfig,
)
from touchdown.core import files
from touchdown.core.errors import Interrupted, UserError
from touchdown.envs import recorder
from touchdown.evaluation import evaluation as evaluations
from touchdown.lander import engine as engines
from touchdown.lander._engine import simd
from touchdown.policies import weights as policy_weights
from touchdown.runs import folder as folders
from touchdown.runs import run as runs
from touchdown.runs.folder import RunFolder
from touchdown.training import selection
from touchdown.training.checkpoint import newest_checkpoint
from touchdown.training.history import History
from touchdown.training.trainer import Trainer


def small_config(**training) -> Config:
    settings = {
        "episodes": 12,
        "validation_period": 100,
        "validation_episodes": 2,
        "candidate_checkpoints": 2,
        "final_validation_episodes": 3,
        "test_episodes": 2,
        "checkpoint_seconds": 0.0,
        "metrics_period": 20,
    }
    return Config(
        env_id="CartPole-v1",
        network=NetworkConfig(hidden_sizes=(8,)),
        replay=ReplayConfig(capacity=200, min_size=20, resaves=1),
        exploration=ExplorationConfig(epsilon_decay=0.9),
        learning=LearningConfig(target_period=30, batch_size=8),
        training=TrainingConfig(**(settings | training)),
    )


def train(folder: RunFolder, should_stop=lambda: False) -> None:
    trainer = Trainer(folder, should_stop=should_stop)
    try:
        trainer.run()
    finally:
        trainer.close()


def after(count: int):
    """A `should_stop` that says yes once, the `count`-th time it is asked."""
    asked = iter(range(1, 1_000_000))
    return lambda: next(asked) == count


def episodes_of(folder: RunFolder) -> list[dict]:
    """The episodes without their wall clock, the one thing that no seed repeats."""
    rows = files.read_jsonl(folder.episodes)
    return [{name: value for name, value in row.items() if name != "seconds"} for row in rows]


def weights_of(folder: RunFolder) -> dict:
    return files.read_tensors(folder.best)[0]


def assert_same_run(one: RunFolder, other: RunFolder) -> None:
    assert episodes_of(one) == episodes_of(other)
    assert one.updates.read_bytes() == other.updates.read_bytes()
    assert one.validations.read_bytes() == other.validations.read_bytes()
    for name, value in weights_of(one).items():
        np.testing.assert_array_equal(value, weights_of(other)[name])


def assert_resumes_exactly(tmp_path, config, *, stops: int, asked: int) -> None:
    """A run stopped `stops` times, each time when asked the `asked`-th time, equals a whole one."""
    whole, stopped = (folders.create(tmp_path, config, name) for name in ("whole", "stopped"))
    train(whole)
    for _ in range(stops):
        with pytest.raises(Interrupted):
            train(stopped, after(asked))
    train(stopped)
    assert_same_run(whole, stopped)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> RunFolder:
    folder = folders.create(tmp_path_factory.mktemp("runs"), small_config(), "finished")
    train(folder)
    return folder


def test_one_seed_repeats_a_run_and_another_differs(finished, tmp_path):
    again = folders.create(tmp_path, small_config(), "again")
    train(again)
    assert_same_run(finished, again)
    other = folders.create(tmp_path, replace(small_config(), seed=1), "other")
    train(other)
    assert episodes_of(other) != episodes_of(finished)


def test_every_episode_and_every_period_is_written_down(finished):
    rows = files.read_jsonl(finished.episodes)
    assert [row["episode"] for row in rows] == list(range(1, 13))
    assert np.cumsum([row["steps"] for row in rows]).tolist() == [
        row["observations"] for row in rows
    ]
    assert {row["outcome"] for row in rows} == {"terminated"}
    assert rows[1]["epsilon"] == pytest.approx(0.9)
    updates = files.read_jsonl(finished.updates)
    assert [row["update"] for row in updates] == [20 * (i + 1) for i in range(len(updates))]
    assert updates[-1]["rewarded_share"] == 1.0  # each step of the cart is a reward
    assert 0 < updates[-1]["terminal_share"] < 0.2
    validated = [row["observations"] for row in files.read_jsonl(finished.validations)]
    assert validated[-1] == rows[-1]["observations"]  # the last weights are a candidate too


def test_tensorboard_reads_the_same_numbers(finished):
    accumulator = EventAccumulator(str(finished.path))
    accumulator.Reload()
    shown = [(e.step, e.value) for e in accumulator.Scalars("rollout/ep_rew")]
    rows = files.read_jsonl(finished.episodes)
    assert shown == [(row["observations"], row["episode_return"]) for row in rows]
    assert len(accumulator.Scalars("train/loss")) == len(files.read_jsonl(finished.updates))


def test_a_stopped_run_goes_on_as_if_it_had_never_stopped(finished, tmp_path):
    folder = folders.create(tmp_path, small_config(), "stopped")
    for _ in range(2):
        with pytest.raises(Interrupted):
            train(folder, after(4))
    assert len(episodes_of(folder)) == 8
    train(folder)
    assert_same_run(finished, folder)
    accumulator = EventAccumulator(str(folder.path))
    accumulator.Reload()
    steps = [event.step for event in accumulator.Scalars("rollout/ep_rew")]
    assert steps == [row["observations"] for row in episodes_of(folder)]


@pytest.mark.parametrize("then", ["exact", "gymnasium"])
def test_a_landing_stopped_in_mid_flight_goes_on_from_there(tmp_path, monkeypatch, then):
    config = replace(small_config(episodes=5), env_id="LunarLander-v3")
    whole, stopped = (folders.create(tmp_path, config, name) for name in ("whole", "stopped"))
    train(whole)
    in_flight = 0
    for _ in range(4):
        with pytest.raises(Interrupted):
            train(stopped, after(1))
        newest = newest_checkpoint(stopped.checkpoints)
        in_flight += len(files.read_tensors(newest / "underway.safetensors")[0]["0.actions"]) > 0
    assert in_flight >= 2
    monkeypatch.setattr(engines, "engine_in_use", lambda: then)  # either flies the same
    train(stopped)
    assert_same_run(whole, stopped)


@pytest.mark.parametrize("n_step", [3, 60])
def test_returns_of_several_steps_and_priorities_go_on_in_mid_flight_too(tmp_path, n_step):
    config = small_config(episodes=4, max_env_steps=240)
    config = replace(
        config,
        env_id="LunarLander-v3",
        replay=replace(config.replay, prioritized=True, resaves=0),
        learning=replace(config.learning, n_step=n_step),
    )
    assert_resumes_exactly(tmp_path, config, stops=5, asked=1)


def test_each_environment_of_a_pool_goes_on_in_mid_flight(tmp_path):
    config = small_config(episodes=12, num_envs=4)
    config = replace(
        config,
        env_id="LunarLander-v3",
        learning=replace(config.learning, update_period=2, n_step=3, target="sarsa"),
    )
    assert_resumes_exactly(tmp_path, config, stops=4, asked=2)


@pytest.mark.parametrize("update_period", [1, 4])
def test_noise_and_atoms_go_on_in_mid_flight_too(tmp_path, update_period):
    config = small_config(episodes=4, max_env_steps=240)
    config = replace(
        config,
        env_id="LunarLander-v3",
        network=replace(config.network, noisy=True, atoms=11),
        exploration=ExplorationConfig(schedule="constant", epsilon_start=0.0),
        learning=replace(config.learning, update_period=update_period),
    )
    assert_resumes_exactly(tmp_path, config, stops=5, asked=1)


def test_a_run_stopped_in_its_last_flight_finishes_it(tmp_path):
    config = replace(small_config(max_env_steps=40), env_id="LunarLander-v3")
    folder = folders.create(tmp_path, config, "last")
    with pytest.raises(Interrupted):
        train(folder, after(1))
    train(folder)
    assert len(episodes_of(folder)) == 1


def test_an_episode_that_does_not_come_to_the_same_place_is_not_resumed(tmp_path):
    config = replace(small_config(), env_id="LunarLander-v3")
    folder = folders.create(tmp_path, config, "moved")
    with pytest.raises(Interrupted):
        train(folder, after(1))
    newest = newest_checkpoint(folder.checkpoints)
    tensors, _ = files.read_tensors(newest / "underway.safetensors")
    data = save({**tensors, "0.observation": tensors["0.observation"] + 1})
    (newest / "underway.safetensors").write_bytes(data)
    state = read_state(newest)
    state["sha256"]["underway"] = hashlib.sha256(data).hexdigest()
    write_state(newest, state)
    with pytest.raises(UserError, match="cannot be repeated exactly"):
        train(folder)


def test_lines_written_after_the_last_checkpoint_are_not_there_twice(finished, tmp_path):
    folder = folders.create(tmp_path, small_config(), "torn")
    with pytest.raises(Interrupted):
        train(folder, after(5))
    with folder.episodes.open("ab") as file:  # what a killed run leaves behind its checkpoint
        file.write(b'{"episode": 6, "observations": 1, "episode_return": 9.0}\n{"episode": 7, "ob')
    (folder.checkpoints / ".00000009.1.tmp").mkdir()
    (folder.path / ".config.1.tmp.toml").write_text("half")
    train(folder)
    assert_same_run(finished, folder)
    assert not list(folder.path.rglob(".*tmp*"))


def test_a_run_stopped_while_choosing_chooses_the_same(finished, tmp_path):
    folder = folders.create(tmp_path, small_config(), "choosing")
    with pytest.raises(Interrupted):
        train(folder, after(13))  # asked once an episode, then once a candidate
    assert len(episodes_of(folder)) == 12
    train(folder)
    assert_same_run(finished, folder)


def test_a_finished_run_is_not_trained_again(finished):
    before = finished.episodes.read_bytes()
    train(finished, should_stop=lambda: pytest.fail("it trained"))
    assert finished.episodes.read_bytes() == before


_CHILD = """
import sys
from pathlib import Path
from touchdown.core import device
device.use("cpu")
from touchdown.runs.folder import RunFolder
from touchdown.training.trainer import Trainer
Trainer(RunFolder(Path(sys.argv[1]))).run()
"""


def test_a_run_killed_at_any_moment_ends_like_one_that_was_not(tmp_path):
    config = small_config(episodes=40)
    whole = folders.create(tmp_path, config, "whole")
    train(whole)
    killed = folders.create(tmp_path, config, "killed")
    for wanted in (3, 12, 30):
        with subprocess.Popen([sys.executable, "-c", _CHILD, str(killed.path)]) as child:
            deadline = time.monotonic() + 60
            while time.monotonic() < deadline and child.poll() is None:
                if killed.episodes.exists() and killed.episodes.read_bytes().count(b"\n") >= wanted:
                    break
                time.sleep(0.001)
            child.send_signal(signal.SIGKILL)
    train(killed)
    assert_same_run(whole, killed)


def test_a_full_disk_leaves_the_last_checkpoint_whole(finished, tmp_path, monkeypatch):
    folder = folders.create(tmp_path, small_config(), "full")
    with pytest.raises(Interrupted):
        train(folder, after(6))
    before = newest_checkpoint(folder.checkpoints)
    real = Path.write_bytes

    def no_space(path: Path, data: bytes) -> int:
        if path.name == "memory.safetensors":
            real(path, data[:10])
            raise OSError(28, "No space left on device", str(path))
        return real(path, data)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", no_space)
        with pytest.raises(OSError, match="No space left"):
            train(folder)
    assert newest_checkpoint(folder.checkpoints) == before
    train(folder)
    assert_same_run(finished, folder)


def test_a_run_goes_on_from_the_checkpoint_before_a_damaged_one(finished, tmp_path):
    folder = folders.create(tmp_path, small_config(), "cut")
    with pytest.raises(Interrupted):
        train(folder, after(8))
    names = sorted(path.name for path in folder.checkpoints.glob("0*"))
    assert len(names) == 2
    (folder.checkpoints / names[1] / "memory.safetensors").write_bytes(b"")
    train(folder)
    assert_same_run(finished, folder)


def only_checkpoint(folder: RunFolder) -> Path:
    """The newest checkpoint, after the others are removed."""
    newest = newest_checkpoint(folder.checkpoints)
    for path in folder.checkpoints.glob("0*"):
        if path != newest:
            shutil.rmtree(path)
    return newest


@pytest.mark.parametrize("name", ["learner", "memory", "acting", "finalists", "underway"])
def test_a_cut_off_checkpoint_is_refused_in_one_line(tmp_path, name):
    folder = folders.create(tmp_path, small_config(), "cut")
    with pytest.raises(Interrupted):
        train(folder, after(8))
    path = only_checkpoint(folder) / f"{name}.safetensors"
    path.write_bytes(path.read_bytes()[:-7])
    before = folder.episodes.read_bytes()
    with pytest.raises(
        UserError, match=f"{name}.safetensors: not a complete safetensors file"
    ) as said:
        Trainer(folder)
    assert "\n" not in str(said.value)
    assert folder.episodes.read_bytes() == before


def test_an_altered_checkpoint_is_refused(tmp_path):
    folder = folders.create(tmp_path, small_config(), "altered")
    with pytest.raises(Interrupted):
        train(folder, after(3))
    path = only_checkpoint(folder) / "memory.safetensors"
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"altered since it was written"):
        Trainer(folder)


def test_a_checkpoint_of_another_config_is_refused(tmp_path):
    folder = folders.create(tmp_path, small_config(), "mine")
    with pytest.raises(Interrupted):
        train(folder, after(3))
    text = folder.config_file.read_text().replace("gamma = 0.99", "gamma = 0.5")
    folder.config_file.write_text(text)
    with pytest.raises(UserError, match=r"config_digest = '\w+': must be"):
        Trainer(RunFolder(folder.path))  # as another process sees it


def test_a_checkpoint_of_another_version_is_refused(tmp_path):
    folder = folders.create(tmp_path, small_config(), "old")
    with pytest.raises(Interrupted):
        train(folder, after(3))
    path = newest_checkpoint(folder.checkpoints)
    write_state(path, read_state(path) | {"format_version": 99})
    with pytest.raises(UserError, match="format_version = 99: must be 3 or 4 in this version"):
        Trainer(folder)


def test_diverging_training_says_what_would_help(tmp_path):
    config = replace(
        small_config(episodes=100), learning=LearningConfig(learning_rate=1e30, batch_size=8)
    )
    folder = folders.create(tmp_path, config, "wild")
    with pytest.raises(UserError, match=r"learning_rate = 1e\+30: training diverged"):
        train(folder)


def test_weights_that_are_not_finite_end_training_at_their_validation(tmp_path, monkeypatch):
    """The loss of the last recorded update may still be finite."""
    folder = folders.create(tmp_path, small_config(), "wild")
    monkeypatch.setattr(History, "update", lambda *_, **__: None)
    diverged = {"layers.0.bias": np.array([1, np.nan, np.inf])}
    with monkeypatch.context() as patch:
        patch.setattr(DQNAgent, "weights", lambda _: diverged)
        with pytest.raises(UserError) as said:
            train(folder)
    assert re.match(
        r"learning_rate = 0\.0005: training diverged at episode \d+, step \d+ \(layers\.0\.bias "
        r"has 2 of 3 numbers that are not finite\); the run stays unfinished; start another with",
        str(said.value),
    )
    assert not folder.best.exists()
    train(folder)  # nothing of it stays
    assert folder.best.exists()


def test_provenance_names_versions_machine_and_seed(finished):
    facts = json.loads(finished.provenance.read_text())
    assert facts["seed"] == 0
    assert facts["config_digest"] == small_config().digest
    assert {"gymnasium", "jax", "box2d"} <= facts["versions"].keys()
    assert facts["cpus_available"] == len(os.sched_getaffinity(0))
    assert facts["simd"] == simd()


def test_names_are_counted_up_and_a_taken_one_is_refused(tmp_path):
    config = replace(small_config(), preset="pilot")
    names = [folders.create(tmp_path, config).name for _ in range(3)]
    assert names == ["pilot-0", "pilot-0-2", "pilot-0-3"]
    with pytest.raises(UserError, match="exists already; choose another"):
        folders.create(tmp_path, config, "pilot-0-2")
    for bad in ("a/b", "..", "", ".hidden"):
        with pytest.raises(UserError, match="must be a plain folder name"):
            folders.create(tmp_path, config, bad)


def test_a_run_that_lost_its_tensorboard_events_goes_on(finished, tmp_path):
    folder = folders.create(tmp_path, small_config(), "eventless")
    with pytest.raises(Interrupted):
        train(folder, after(5))
    for path in folder.path.glob("events.*"):
        path.unlink()
    train(folder)
    assert_same_run(finished, folder)


def test_a_run_that_lost_its_checkpoints_is_trained_from_the_start(finished, tmp_path):
    folder = folders.create(tmp_path, small_config(), "bare")
    with pytest.raises(Interrupted):
        train(folder, after(5))
    shutil.rmtree(folder.checkpoints)
    train(folder)
    assert_same_run(finished, folder)


def test_two_trainers_never_share_a_run(tmp_path):
    folder = folders.create(tmp_path, small_config(), "shared")
    first = Trainer(folder)
    with pytest.raises(UserError, match="run 'shared': another process is training it"):
        Trainer(folder)
    first.close()
    Trainer(folder).close()


def test_a_run_on_stock_gymnasium_is_the_same_run(tmp_path, monkeypatch):
    config = replace(small_config(), env_id="LunarLander-v3")
    runs: list[RunFolder] = []
    for engine in ("exact", "gymnasium"):
        monkeypatch.setattr("touchdown.lander.engine._chosen", [engine])
        runs.append(folders.create(tmp_path, config, engine))
        train(runs[-1])
        assert json.loads(runs[-1].provenance.read_text())["engine"] == engine
    assert_same_run(*runs)


# --- other algorithms ---


def table_config(preset: str, **training) -> Config:
    """A preset of a table, run as shortly as the network's runs here."""
    base = presets.preset(preset)
    settings = {
        "max_env_steps": 400,
        "validation_period": 100,
        "validation_episodes": 3,
        "candidate_checkpoints": 2,
        "final_validation_episodes": 3,
        "test_episodes": 2,
        "checkpoint_seconds": 0.0,
        "metrics_period": 20,
    }
    training = {**settings, **training}
    return replace(base, training=replace(base.training, **training))


def lander_table() -> Config:
    config = table_config("tabular-lander", num_envs=2, max_env_steps=500)
    bins = (2, 2, 2, 2, 2, 2, 1, 1)
    return replace(
        config,
        table=replace(config.table, bins=bins),
        learning=replace(config.learning, target="sarsa"),
    )


def pqn_config(env_id: str) -> Config:
    base = presets.preset("pqn")
    return replace(
        small_config(num_envs=3, episodes=1_000, max_env_steps=600),
        env_id=env_id,
        algorithm="pqn",
        network=replace(base.network, hidden_sizes=(8,)),
        replay=ReplayConfig(),
        learning=base.learning,
        rollout=replace(base.rollout, rollout_steps=11),
    )


OTHERS = {
    "a table": table_config("tabular-q"),
    "sarsa in three environments": table_config("tabular-sarsa", num_envs=3),
    "expected sarsa": table_config("tabular-expected-sarsa"),
    "a plan": table_config("value-iteration"),
    "a lander cut into states": lander_table(),
    "pqn": pqn_config("LunarLander-v3"),
    "deep sarsa": replace(
        small_config(episodes=1_000, max_env_steps=300, num_envs=2),
        env_id="LunarLander-v3",
        learning=LearningConfig(target="sarsa", n_step=3, target_period=30, batch_size=8),
    ),
}


@pytest.mark.parametrize("config", OTHERS.values(), ids=OTHERS)
def test_whatever_learns_goes_on_in_mid_flight_as_if_it_had_never_stopped(tmp_path, config):
    whole, stopped = (folders.create(tmp_path, config, name) for name in ("whole", "stopped"))
    train(whole)
    in_flight = 0
    for _ in range(5):
        with pytest.raises(Interrupted):
            train(stopped, after(1))
        newest = newest_checkpoint(stopped.checkpoints)
        underway = files.read_tensors(newest / "underway.safetensors")[0]
        in_flight += any(
            len(actions) for name, actions in underway.items() if name.endswith(".actions")
        )
    assert in_flight >= (3 if config.training.num_envs > 1 else 0)
    train(stopped)
    assert_same_run(whole, stopped)
    assert files.read_jsonl(whole.updates)
    rows = files.read_jsonl(whole.episodes)
    assert rows[-1]["observations"] >= config.training.max_env_steps
    policy = runs.load_run(whole)
    assert policy.env_id == config.env_id
    evaluation = evaluations.evaluate_policy(policy, range(2))
    assert [episode.seed for episode in evaluation.episodes] == [0, 1]


def test_the_table_of_a_run_is_flown_from_its_file(tmp_path):
    folder = folders.create(tmp_path, table_config("tabular-q"), "table")
    train(folder)
    q = weights_of(folder)["q"]
    assert q.shape == (16, 4)
    policy = policy_weights.load_weights(folder.best).policy
    seen = np.eye(16, dtype=np.float32)
    np.testing.assert_array_equal(policy.act(seen), q.argmax(axis=1))
    assert recorder.record_flight(policy, "FrozenLake-v1", 0, "table").steps > 0


@pytest.mark.parametrize(
    ("tensors", "changes", "said"),
    [
        (
            {"q": np.zeros((8, 4))},
            {},
            r"'FrozenLake-v1': q is float64\(8, 4\), must be float64\(16, 4\)",
        ),
        ({"p": np.zeros((16, 4))}, {}, r"'FrozenLake-v1': it has \['p'\], must be q, the table"),
        (
            {"q": np.zeros((16, 4))},
            {"env_id": "CartPole-v1"},
            r"'CartPole-v1': bins = \(\): must be 4 numbers",
        ),
        (
            {"q": np.zeros((16, 4))},
            {"table": '{"bins": [4], "bins_low": [0], "bins_high": [1]}'},
            r"'FrozenLake-v1': bins = \(4,\): must be \(\) for an environment of 16",
        ),
        (
            {"q": np.zeros((16, 4))},
            {"table": '{"bins": "all"}'},
            r"not a policy's weights: bins = 'all': must be a list",
        ),
        (
            {"q": np.zeros((16, 4))},
            {"network": "{}"},
            r"not a policy's weights: must describe either a network or a table",
        ),
    ],
)
def test_a_table_of_another_shape_is_refused_in_one_line(tmp_path, tensors, changes, said):
    path = tmp_path / "odd.safetensors"
    metadata = {"format_version": "2", "env_id": "FrozenLake-v1", "table": "{}"}
    path.write_bytes(save(tensors, metadata | changes))
    with pytest.raises(UserError, match=said) as refused:
        policy_weights.load_weights(path)
    assert str(refused.value).startswith(f"{path}: not a policy's weights")
    assert "\n" not in str(refused.value)


def solving_config(**training: Any) -> Config:
    settings = {"stop_when_solved": True, "final_validation_episodes": 30, "episodes": 200}
    return small_config(**{**settings, **training})


def test_a_run_stops_as_soon_as_fresh_starts_leave_no_doubt(tmp_path, monkeypatch):
    monkeypatch.setattr(selection, "threshold_of", lambda _: 1.0)  # every return is above it
    folder = folders.create(tmp_path, solving_config(), "solved")
    train(folder)
    validations, facts = files.read_jsonl(folder.validations), policy_weights.facts_of(folder.best)
    assert len(validations) == 1
    assert facts.env_steps == validations[0]["observations"]
    assert facts.solved_seconds > 0
    assert facts.final_validation_return > 1.0
    assert len(files.read_jsonl(folder.episodes)) < 200


def test_a_mean_just_above_the_threshold_leaves_doubt(tmp_path, monkeypatch):
    config = solving_config(episodes=20)
    looked = folders.create(
        tmp_path,
        replace(config, training=replace(config.training, stop_when_solved=False)),
        "looked",
    )
    train(looked)
    best = max(row["mean_return"] for row in files.read_jsonl(looked.validations))
    monkeypatch.setattr(selection, "threshold_of", lambda _: best)
    folder = folders.create(tmp_path, config, "doubted")
    train(folder)
    assert policy_weights.facts_of(folder.best).solved_seconds is None
    assert len(files.read_jsonl(folder.episodes)) == 20


def test_an_environment_without_a_threshold_cannot_be_solved():
    config = replace(solving_config(), env_id="Pendulum-v1")
    with pytest.raises(UserError, match="stop_when_solved = True: must be False for env_id = 'Pen"):
        selection.stop_threshold(config)
    assert selection.stop_threshold(small_config()) is None
