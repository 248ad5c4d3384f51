import multiprocessing
import time
from dataclasses import replace

import pytest

from finished_runs import write_run
from touchdown.config.presets import preset
from touchdown.studies import estimate as estimates
from touchdown.studies.estimate import Estimate, estimate, kind_of
from touchdown.studies.store import open_store
from touchdown.studies.tuners import Tuning
from touchdown.studies.work import BaselineJob, PidJob, TrainJob

BASE = preset("paper-best")


def job(seed: int = 0, observations: int = 50_000, **sections) -> TrainJob:
    changed = {name: replace(getattr(BASE, name), **values) for name, values in sections.items()}
    training = replace(BASE.training, max_env_steps=observations)
    return TrainJob(replace(BASE, seed=seed, training=training, **changed))


@pytest.fixture
def store(tmp_path):
    return open_store(tmp_path, make=True)


@pytest.fixture(autouse=True)
def _known_flights(monkeypatch):
    monkeypatch.setattr(estimates, "_fly", lambda _: estimates._FlightTimes(0.01, 0.1))


def test_what_is_missing_takes_what_its_kind_took_and_the_flights_after_it(store):
    done, missing, another = job(0), job(1), job(2)
    write_run(store.runs / done.digest)  # 4,000 env steps in 40 seconds
    found = estimate([done, missing, another], [], store, 2)
    # five candidates of a hundred flights, then two tests of a hundred
    seconds = 50_000 / 100 + 500 * 0.01 + 200 * 0.1
    assert found == Estimate(2, 0, env_steps=100_000, seconds=seconds, measured=0)


def test_validations_are_counted_where_only_training_was_timed(store, monkeypatch):
    pace = estimates._Pace(1_000, validated=False)
    monkeypatch.setattr(estimates, "_in_workers", lambda _, each, __: iter([pace] * len(each)))
    told = []
    jobs = [job(), job(1, network={"hidden_sizes": (8,)})]
    found = estimate(jobs, [], store, 1, told.append)
    # each: five validations of twenty flights on the way
    assert found.seconds == 2 * (50 + (500 + 5 * 20) * 0.01 + 200 * 0.1)
    assert (found.measured, told) == (2, [0.5, 1.0])


def test_a_tuning_takes_its_trials_and_gains_by_hand_one(store, monkeypatch):
    monkeypatch.setattr(estimates, "_try_gains", lambda _: 0.5)
    tunings = [
        PidJob(Tuning(tuner=tuner, seed=seed, trials=20))
        for tuner, seed in (("twiddle", 0), ("hand", 0), ("tpe", 0), ("tpe", 1))
    ]
    done = store.runs / tunings[3].digest
    done.mkdir()
    for file in ("evaluation.json", "flights.safetensors"):
        (done / file).write_text("{}")
    found = estimate([], tunings, store, 2)
    assert found == Estimate(0, 3, env_steps=0, seconds=(20 + 1 + 20) * 0.5 / 2, measured=0)
    assert str(found).startswith("3 PID tunings are missing: about 1 min here")


def test_one_trial_of_a_tuning_is_timed_by_flying_it():
    assert 0 < estimates._try_gains(Tuning(tuner="hand", seed=0, starts=2)) < 60


def test_nothing_is_measured_where_nothing_is_missing(store):
    write_run(store.runs / job().digest)
    found = estimate([job()], [], store, 2)
    assert found == Estimate(0, 0, env_steps=0, seconds=0, measured=0)
    assert str(found) == "nothing is missing"


def test_records_alone_are_counted_and_nothing_is_trained_for_them(store):
    write_run(store.runs / job().digest, recorded=False)
    found = estimate([job()], [], store, 2, baselines=[BaselineJob("pid")])
    assert found == Estimate(0, 0, env_steps=0, seconds=0, measured=0, unrecorded=2)
    assert str(found).startswith(
        "the flights of 2 baselines or finished runs are missing: about 1 min here"
    )


def test_a_long_study_is_told_in_hours():
    assert "about 2 h 5 min here" in str(Estimate(3, 0, 2_000_000, 7_500.0, 1))
    assert str(Estimate(3, 4, 2_000_000, 7.0, 1)).startswith(
        "3 runs of 2.0 million env steps and 4 PID tunings are missing: about 1 min here"
    )


@pytest.mark.parametrize(
    ("sections", "same"),
    [
        ({"learning": {"gamma": 0.9}}, True),
        ({"replay": {"resaves": 3}}, True),
        ({"network": {"hidden_sizes": (9,)}}, False),
        ({"learning": {"update_period": 7}}, False),
        ({"training": {"num_envs": 3}}, False),
    ],
)
def test_runs_of_one_kind_are_those_that_cost_the_same(sections, same):
    changed = {name: replace(getattr(BASE, name), **values) for name, values in sections.items()}
    assert (kind_of(replace(BASE, **changed)) == kind_of(BASE)) == same


def test_a_measurement_that_is_stopped_does_not_wait_for_its_workers():
    results = estimates._in_workers(time.sleep, [0.0, 3_600.0], 1)
    next(results)
    results.close()
    assert not multiprocessing.active_children()
