"""What a run records so that its training can be watched later."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import touchdown.lander
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TrainingConfig,
)
from touchdown.core import files
from touchdown.core.errors import Interrupted
from touchdown.lander import engine as engines
from touchdown.policies import weights as policy_weights
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.loop import why_python
from touchdown.runs.run import Run
from touchdown.training import policy_saver
from touchdown.training.policy_saver import kept
from touchdown.training.trainer import Trainer


def config_of(env_id="LunarLander-v3", n_step=1, **training) -> Config:
    """Small settings under which episodes end and updates take place."""
    settings = {
        "episodes": 12,
        "validation_period": 300,
        "validation_episodes": 2,
        "candidate_checkpoints": 2,
        "final_validation_episodes": 3,
        "test_episodes": 2,
        "checkpoint_seconds": 0.0,
    }
    return Config(
        env_id=env_id,
        seed=3,
        network=NetworkConfig(hidden_sizes=(12, 8)),
        replay=ReplayConfig(capacity=500, min_size=40),
        exploration=ExplorationConfig(epsilon_decay=0.8),
        learning=LearningConfig(backend="fused", batch_size=8, n_step=n_step),
        training=TrainingConfig(**(settings | training)),
    )


def pqn(config: Config) -> Config:
    """The same settings for PQN, as far as it has them."""
    return replace(
        config,
        algorithm="pqn",
        replay=ReplayConfig(),
        learning=LearningConfig(backend="fused"),
        rollout=RolloutConfig(rollout_steps=8, minibatches=2),
    )


def train(folder: RunFolder, should_stop=lambda: False, *, replayable=True, may_compile=True):
    trainer = Trainer(
        folder, should_stop=should_stop, replayable=replayable, may_compile=may_compile
    )
    try:
        trainer.run()
    finally:
        trainer.close()


def after(count: int):
    """A `should_stop` that says yes once, the `count`-th time it is asked."""
    asked = iter(range(1, 1_000_000))
    return lambda: next(asked) == count


def stop_and_resume(folder: RunFolder, *, may_compile: bool = True) -> None:
    """Train a run that is stopped several times, mostly in the middle of an episode."""
    for count in (2, 5, 1, 3):
        with pytest.raises(Interrupted):
            train(folder, after(count), may_compile=may_compile)
        with folder.training_flights.open("ab") as file:  # as a killed run would leave
            file.write(b'{"episode": 99, "start": 1, "actions": "", "steps": 0}\n{"episode"')
    train(folder, may_compile=may_compile)


def assert_flown_again(folder: RunFolder) -> None:
    """Each recorded flight, flown by hand, has the return and the end of its episode."""
    rows = files.read_jsonl(folder.episodes)
    flights = Run(folder).training_flights
    assert [flight.episode for flight in flights] == [row["episode"] for row in rows]
    env = touchdown.lander.make(engine="exact")
    for flight, row in zip(flights, rows, strict=True):
        env.reset(seed=flight.start)
        episode_return, over = 0.0, []
        for action in flight.actions:
            _, reward, terminated, truncated, _ = env.step(int(action))
            episode_return += float(reward)
            over.append(terminated or truncated)
        assert over == [False] * (row["steps"] - 1) + [True]
        assert episode_return == row["episode_return"]


@pytest.mark.parametrize("stopped", [False, True])
@pytest.mark.parametrize("may_compile", [True, False])
@pytest.mark.parametrize(
    ("num_envs", "n_step", "algorithm"),
    [(1, 1, "dqn"), (3, 1, "dqn"), (3, 3, "dqn"), (3, 1, "pqn")],
)
def test_start_and_actions_give_each_training_episode_again(
    tmp_path, num_envs, n_step, algorithm, may_compile, stopped
):
    config = config_of(num_envs=num_envs, n_step=n_step)
    if algorithm == "pqn":
        config = pqn(config)
    folder = folders.create(tmp_path, config, "flown")
    if stopped:
        stop_and_resume(folder, may_compile=may_compile)
    else:
        train(folder, may_compile=may_compile)
    assert_flown_again(folder)


def test_the_flights_of_both_loops_are_the_same(tmp_path):
    config = config_of(num_envs=3)
    assert why_python(config) is None
    fast, slow = (folders.create(tmp_path, config, name) for name in ("fast", "slow"))
    train(fast)
    train(slow, may_compile=False)
    assert fast.training_flights.read_bytes() == slow.training_flights.read_bytes()


def test_stock_gymnasium_flies_the_same(tmp_path, monkeypatch):
    folder = folders.create(tmp_path, config_of(), "stock")
    monkeypatch.setattr(engines, "_chosen", ["gymnasium"])
    train(folder)
    assert_flown_again(folder)


def test_a_run_that_is_not_to_be_watched_records_neither(tmp_path):
    folder = folders.create(tmp_path, config_of(), "study")
    train(folder, replayable=False)
    assert not folder.training_flights.exists()
    assert not folder.over_training.exists()
    assert Run(folder).training_flights == []
    assert Run(folder).policies_over_training == []


def test_a_run_resumed_without_recording_has_the_flights_until_then(tmp_path):
    folder = folders.create(tmp_path, config_of(), "half")
    with pytest.raises(Interrupted):
        train(folder, after(6))
    flown = len(Run(folder).training_flights)
    assert flown > 0
    with folder.training_flights.open("ab") as file:
        file.write(b"more")
    train(folder, replayable=False)
    assert len(Run(folder).training_flights) == flown < len(files.read_jsonl(folder.episodes))


def test_other_environments_have_policies_and_no_flights(tmp_path):
    folder = folders.create(tmp_path, config_of("CartPole-v1"), "cart")
    train(folder)
    assert not folder.training_flights.exists()
    assert Run(folder).policies_over_training


def weights_at(path):
    return files.read_tensors(path)[0]


def test_the_policy_is_saved_before_training_and_at_each_validation(tmp_path):
    folder = folders.create(tmp_path, config_of(), "watched")
    train(folder)
    saved = Run(folder).policies_over_training
    rows = files.read_jsonl(folder.validations)
    assert [policy.env_steps for policy in saved] == [0, *(row["observations"] for row in rows)]
    assert saved[0].path.name == "00000000.safetensors"
    for policy, row in zip(saved[1:], rows, strict=True):
        facts = policy_weights.facts_of(policy.path)
        assert facts.env_steps == policy.env_steps
        assert facts.validation_return == row["mean_return"]
    best = policy_weights.facts_of(folder.best).env_steps
    (selected,) = [policy for policy in saved if policy.env_steps == best]
    for name, value in weights_at(folder.best).items():
        assert_array_equal(weights_at(selected.path)[name], value)
    first = policy_weights.load_weights(saved[0].path)
    assert first.env_id == "LunarLander-v3"
    assert first.policy.act(np.zeros((2, 8), np.float32)).shape == (2,)


def files_of(folder: RunFolder) -> dict[str, bytes]:
    return {policy.path.name: policy.path.read_bytes() for policy in policies_of(folder)}


def policies_of(folder: RunFolder):
    return Run(folder).policies_over_training


@pytest.mark.parametrize(("most", "count"), [(100, 10), (4, 4)])
def test_a_stopped_run_ends_with_the_same_policies(tmp_path, monkeypatch, most, count):
    monkeypatch.setattr(policy_saver, "MOST_POLICIES", most)
    config = config_of(validation_period=100)
    whole, stopped = (folders.create(tmp_path, config, name) for name in ("whole", "stopped"))
    train(whole)
    stop_and_resume(stopped)
    assert files_of(stopped) == files_of(whole)
    assert len(files_of(whole)) == count


def test_policies_later_than_the_checkpoint_are_removed(tmp_path):
    folder = folders.create(tmp_path, config_of(), "torn")
    with pytest.raises(Interrupted):
        train(folder, after(9))
    before = files_of(folder)
    (folder.over_training / "00999999.safetensors").write_bytes(b"later")
    (folder.over_training / "notes.txt").write_text("mine")
    Trainer(folder, replayable=True).close()
    assert files_of(folder) == before
    assert (folder.over_training / "notes.txt").read_text() == "mine"


def test_every_second_policy_goes_when_there_are_too_many():
    assert kept([0]) == {0}
    assert kept(range(99)) == set(range(99))
    assert kept(range(100)) == {*range(0, 100, 2), 99}
    assert kept(range(197)) == set(range(0, 197, 2))
    assert kept(range(200)) == {*range(0, 200, 4), 199}
    for count in range(1, 1_000):
        assert len(kept(range(count))) <= 100
        assert {0, count - 1} <= kept(range(count))
        # what a later count keeps, an earlier one has kept too
        assert kept(range(count + 1)) - {count} <= kept(range(count))


def test_a_config_of_another_seed_flies_other_starts(tmp_path):
    starts = []
    for seed in (3, 4):
        folder = folders.create(tmp_path, replace(config_of(episodes=3), seed=seed), f"run-{seed}")
        train(folder)
        starts.append([flight.start for flight in Run(folder).training_flights])
    assert not set(starts[0]) & set(starts[1])
