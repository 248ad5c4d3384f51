from pathlib import Path

import pytest

from finished_runs import write_run
from small_configs import lake
from touchdown.config.presets import preset
from touchdown.core.errors import Interrupted
from touchdown.envs.flight import load_flights
from touchdown.evaluation.evaluation import median_start, read_evaluations
from touchdown.evaluation.paths import load_paths
from touchdown.runs.folder import RunFolder
from touchdown.studies import work
from touchdown.studies.tuners import Tuning
from touchdown.studies.work import BaselineJob, PidJob, TrainJob


def perform(job, store: Path) -> RunFolder:
    job.perform(store, lambda: False, lambda _progress: None)
    return RunFolder(store / job.digest)


def test_a_run_has_results_before_its_flights_are_recorded(tmp_path):
    job = TrainJob(preset("pilot"))
    assert not job.has_results(tmp_path)
    write_run(tmp_path / job.digest)
    assert job.has_results(tmp_path)
    assert job.is_done(tmp_path)
    RunFolder(tmp_path / job.digest).paths.unlink()
    assert job.has_results(tmp_path)
    assert not job.is_done(tmp_path)


def test_a_run_of_another_environment_has_no_paths(tmp_path):
    job = TrainJob(preset("cartpole"))
    write_run(tmp_path / job.digest)
    RunFolder(tmp_path / job.digest).paths.unlink()
    assert job.is_done(tmp_path)


def test_gains_that_were_tuned_by_an_earlier_version_get_their_flight_and_stay(
    tmp_path, monkeypatch
):
    job = PidJob(Tuning(tuner="hand", seed=0, trials=1, starts=1, test_episodes=3))
    folder = perform(job, tmp_path)
    assert job.is_done(tmp_path)
    (flight,) = load_flights(folder.flights)
    assert flight.seed == median_start(read_evaluations(folder.evaluation)[0])
    folder.flights.unlink()
    assert job.has_results(tmp_path)
    assert not job.is_done(tmp_path)
    monkeypatch.setattr(work, "tune", None)  # it would fail
    perform(job, tmp_path)
    assert job.is_done(tmp_path)


def test_a_run_that_a_power_loss_damaged_starts_anew(tmp_path, capsys):
    job = TrainJob(lake())
    whole = perform(job, tmp_path / "whole")
    asked = iter(range(100))
    with pytest.raises(Interrupted):
        job.perform(tmp_path, lambda: next(asked) == 9, lambda _progress: None)
    folder = RunFolder(tmp_path / job.digest)
    size = folder.episodes.stat().st_size
    assert size > 0
    folder.episodes.write_bytes(b"\0" * size)
    perform(job, tmp_path)
    said = f"{folder.episodes}: altered since its checkpoint was written (its SHA-256 differs)"
    assert said in capsys.readouterr().err
    assert folder.best.read_bytes() == whole.best.read_bytes()


@pytest.mark.parametrize("name", ["pid", "random"])
def test_a_baseline_has_its_returns_and_its_paths(tmp_path, monkeypatch, name):
    monkeypatch.setattr(work, "_BASELINE_EPISODES", 2)
    job = BaselineJob(name)
    with pytest.raises(Interrupted):
        job.perform(tmp_path, lambda: True, lambda _progress: None)
    assert not job.is_done(tmp_path)
    folder = perform(job, tmp_path)
    assert job.is_done(tmp_path)
    (evaluation,) = read_evaluations(folder.evaluation)
    paths = load_paths(folder.paths)
    steps = {episode.seed: episode.steps for episode in evaluation.episodes}
    assert {start: len(path) - 1 for start, path in paths.items()} == steps


def test_a_baseline_is_identified_by_all_that_decides_its_flights(monkeypatch):
    pid = BaselineJob("pid").digest
    assert pid.startswith("baseline-pid-")
    assert BaselineJob("random").digest.startswith("baseline-random-")
    monkeypatch.setattr(work.baselines, "shipped_pid", lambda: work.baselines.read_pid(ABSOLUTE))
    assert BaselineJob("pid").digest != pid


ABSOLUTE = Path(work.__file__).parents[1] / "control" / "pid_absolute.toml"
