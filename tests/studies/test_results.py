import math

import pytest
from numpy.testing import assert_allclose

from finished_runs import evaluation, write_run, write_validations
from touchdown.config.presets import preset
from touchdown.config.toml import to_toml
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.evaluation.evaluation import write_evaluations
from touchdown.policies.facts import WeightsFacts
from touchdown.studies.pid_results import read_pid
from touchdown.studies.plan import Factor, Level, Study, levels_of
from touchdown.studies.results import read_study
from touchdown.studies.run_result import read_run
from touchdown.studies.store import open_store
from touchdown.studies.tuners import Tuned, Tuning
from touchdown.studies.work import PidJob
from touchdown.training import pid_tuning


def test_a_finished_run_is_read_in_numbers(tmp_path):
    write_run(tmp_path / "abc", last=(50.0, 150.0))
    run = read_run(tmp_path / "abc", ("0.9",), 3)
    assert (run.name, run.labels, run.seed) == ("abc", ("0.9",), 3)
    assert (run.best_return, run.last_return, run.worst_return) == (200, 100, 100)
    assert (run.share_solved, run.landed, run.hover_share) == (0.5, 0.5, 0.5)
    assert (run.env_steps, run.seconds) == (4_000, 40)
    # trapezoids 100 000 to 2,000, 262 500 to 3,500, then 250 to the end
    assert_allclose(run.area, (100_000 + 262_500 + 125_000) / 4_000)
    # rising from 0 by one in twenty: half of what it is at a third of the way
    assert_allclose(run.early_return, 4_000 / 3 / 20 / 2)
    assert (run.env_steps_to_solved, run.seconds_to_solved) == (3_500, 35)
    at, shares = run.hovering
    assert_allclose(at, (1_000, 2_000, 3_000, 4_000), atol=4_000 / 24)
    assert shares == (1, 1, 0, 0)


def test_a_run_without_flights_of_its_last_weights_is_judged_by_the_chosen_ones(tmp_path):
    write_run(tmp_path / "abc")
    assert read_run(tmp_path / "abc", (), 0).last_return == 200


def test_a_run_that_never_got_there_is_shown_as_such(tmp_path):
    write_run(tmp_path / "abc")
    write_validations(tmp_path / "abc", [(500, 199.9)])
    run = read_run(tmp_path / "abc", (), 0)
    assert math.isinf(run.env_steps_to_solved)
    assert math.isinf(run.seconds_to_solved)


def test_a_broken_run_is_named(tmp_path):
    write_run(tmp_path / "abc")
    (tmp_path / "abc/episodes.jsonl").write_text("{}\n")
    with pytest.raises(UserError, match=r"episodes\.jsonl"):
        read_run(tmp_path / "abc", (), 0)


def test_a_study_knows_what_is_done_what_failed_and_what_is_missing(tmp_path):
    study = Study(
        name="discount", factors=(Factor("γ", levels_of("learning.gamma", [0.9, 0.99])),), seeds=2
    )
    store = open_store(tmp_path, make=True)
    done, failed, *_ = study.runs()
    write_run(store.runs / done.digest)
    store.note_failure(failed.digest, "it diverged")
    found = read_study(study, 2, store)
    assert (found.planned, len(found.runs), found.missing) == (4, 1, 2)
    assert found.failed == {failed.digest: "it diverged"}
    assert found.values(("0.9",)).tolist() == [200]
    assert found.values(("0.99",)).tolist() == []
    (row,) = found.table().to_dicts()
    assert (row["study"], row["γ"], row["seed"], row["best_return"]) == ("discount", "0.9", 0, 200)
    assert row["observations_to_solved"] == 3_500


def test_a_run_of_several_studies_is_read_once(tmp_path):
    store = open_store(tmp_path / "results", make=True)
    gammas = Study(name="one", factors=[Factor.of("learning.gamma", [0.9, 0.95])], seeds=1)
    same = Study(name="two", factors=[Factor("of", [Level("near", {"learning.gamma": 0.9})])])
    for planned in gammas.runs():
        write_run(store.runs / planned.digest)
    known = {}
    first = read_study(gammas, 1, store, known)
    for planned in gammas.runs():
        (store.runs / planned.digest / "episodes.jsonl").unlink()
    again = read_study(same, 1, store, known)
    assert [run.labels for run in again.runs] == [("near",)]
    assert again.runs[0].path == first.runs[0].path


def test_tunings_that_are_done_are_read(tmp_path):
    store = open_store(tmp_path, make=True)
    done, missing = (PidJob(Tuning(tuner="tpe", seed=seed, trials=2)) for seed in range(2))
    folder = store.runs / done.digest
    folder.mkdir()
    files.write_atomic(
        folder / "tuning.json",
        files.to_json(Tuned(pid_tuning.HAND_PICKED, 210.0, (90.0, 210.0)).to_json()),
    )
    write_evaluations(folder / "evaluation.json", [evaluation([190.0, 210.0])], WeightsFacts())
    (found,) = read_pid([done, missing], store)
    assert (found.job, found.trained_return, found.history) == (done, 210, (90, 210))
    assert found.test.summary.mean_return == 200


def test_a_finished_run_without_its_evaluation_is_refused(tmp_path):
    write_run(tmp_path / "abc", recorded=False)
    (tmp_path / "abc/config.toml").write_text(to_toml(preset("pilot")))
    (tmp_path / "abc/evaluation.json").unlink(missing_ok=True)
    with pytest.raises(UserError, match=r"evaluation\.json: missing from a finished run"):
        read_run(tmp_path / "abc", (), 0)
