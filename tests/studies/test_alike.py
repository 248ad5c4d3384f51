import numpy as np
from numpy.testing import assert_allclose

from finished_runs import record, write_run
from touchdown.envs.recorder import record_flight
from touchdown.evaluation.evaluator import Evaluator
from touchdown.evaluation.paths import PathRecorder
from touchdown.policies import lookup
from touchdown.runs.folder import RunFolder
from touchdown.studies.alike import (
    AgentDistances,
    SeedDistances,
    agent_distances,
    compare_paths,
    distance,
)
from touchdown.studies.plan import Factor, Study, levels_of
from touchdown.studies.results import read_study
from touchdown.studies.store import open_store
from touchdown.studies.work import BaselineJob

PID, RANDOM = lookup.load("pid"), lookup.load("random")
STARTS = [1_000_000, 1_000_001, 1_000_002]


def path(*points):
    return np.array(points, np.float32)


def test_a_flight_is_no_distance_from_itself():
    own = path((0, 1), (0, 0.5), (0, 0))
    assert distance(own, own) == 0


def test_the_distance_is_the_mean_over_steps_in_metres():
    # 0, 10 and 20 m apart
    one, other = path((0, 0), (0, 0), (0, 0)), path((0, 0), (1, 0), (2, 0))
    assert_allclose(distance(one, other), 10)
    assert distance(other, one) == distance(one, other)


def test_a_lander_that_is_down_stays_where_it_is():
    # 0, then 6.67 m three times
    short, long = path((0, 1), (0, 0)), path((0, 1), (0, 1), (0, 1), (0, 1))
    assert_allclose(distance(short, long), 20 / 3 * 3 / 4, rtol=1e-6)


def recorded(policy):
    recorder = PathRecorder(STARTS)
    evaluator = Evaluator(policy.env_id, 2)
    evaluator.rollout(policy.policy, STARTS, observer=recorder)
    evaluator.close()
    return recorder.paths


def flown(policy):
    """The same paths from flights that are flown one by one, as a film's are."""
    flights = [record_flight(policy.policy, policy.env_id, start, "x") for start in STARTS]
    return {flight.seed: flight.observations[:, :2] for flight in flights}


def test_distances_from_recorded_paths_equal_those_between_flights_that_are_flown():
    from_records, from_flights = (
        compare_paths({0: of(PID), 1: of(RANDOM)}, of(PID), of(RANDOM)) for of in (recorded, flown)
    )
    assert from_records == from_flights
    pid, random = from_records.of
    assert from_records.starts == 3
    assert pid.to_pid == 0 < pid.to_random
    assert random.to_random == 0 < random.to_pid == pid.to_random
    assert pid.to_other_seeds == {1: pid.to_random}
    assert random.to_other_seeds == {0: pid.to_random}


def test_only_starts_that_all_have_flown_are_compared():
    here, there = path((0, 0)), path((1, 0))
    found = compare_paths({0: {7: here}}, {7: there, 8: here}, {8: here, 7: here})
    assert (found.starts, found.of[0].to_pid) == (1, 10)


def test_the_ratio_is_that_of_the_pid_to_another_seed():
    found = AgentDistances(
        (SeedDistances(0, 3.0, 9.0, {1: 1.0, 2: 2.0}), SeedDistances(1, 3.0, 9.0, {})), 5
    )
    assert_allclose(found.values("to the PID, over to another seed", "ratio"), [2])
    assert_allclose(found.values("to random", "distance"), [9, 9])
    first = found.until(2).until(1)
    assert [each.seed for each in first.of] == [0]
    assert_allclose(found.until(2).values("to another seed", "distance"), [1])


def test_runs_without_recorded_paths_are_left_out(tmp_path):
    store = open_store(tmp_path, make=True)
    study = Study(name="a", factors=(Factor("γ", levels_of("learning.gamma", [0.9])),), seeds=2)
    first, second = study.runs()
    write_run(store.runs / first.digest)
    write_run(store.runs / second.digest, recorded=False)
    results = read_study(study, 2, store)
    assert agent_distances(results, ("0.9",), store) is None  # the baselines are not flown
    for name, height in (("pid", 0.0), ("random", 4.0)):
        folder = store.runs / BaselineJob(name).digest
        folder.mkdir()
        record(RunFolder(folder), height)
    (only,) = agent_distances(results, ("0.9",), store).of
    assert only.seed == 0
    assert_allclose([only.to_pid, only.to_random], [20 / 3, 20])
