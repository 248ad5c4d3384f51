import html
import json
import re
import shutil

import pytest

import touchdown
from touchdown.api import studies
from touchdown.cli import app
from touchdown.config import toml
from touchdown.core.errors import Interrupted, UserError
from touchdown.studies import store as stores
from touchdown.studies.executors import LocalExecutor
from touchdown.studies.store import open_store

STUDY = """
base = "cartpole"
seeds = 2
[config.training]
max_env_steps = 1500
validation_period = 500
validation_episodes = 3
final_validation_episodes = 3
test_episodes = 4
[config.replay]
min_size = 200
[[factor]]
field = "learning.gamma"
values = [0.9, 0.99]
"""


class Stopped:
    """An executor that is stopped before it does anything."""

    workers = 1

    def run(self, *_: object) -> None:
        raise Interrupted


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A finished study: its file and its results."""
    folder = tmp_path_factory.mktemp("study")
    file = folder / "tiny.toml"
    file.write_text(STUDY)
    state = studies.run_study(str(file), executor=LocalExecutor(2), results_dir=folder / "results")
    assert (state.total, state.done, state.failed) == (4, 4, {})
    return file, folder / "results"


def test_its_runs_are_ordinary_run_folders(done):
    _, results = done
    runs = touchdown.list_runs(results / "runs")
    assert [run.status for run in runs] == ["finished"] * 4
    assert {run.config.digest for run in runs} == {run.name for run in runs}
    assert all(len(run.evaluation.episodes) == 4 for run in runs)


def test_run_again_it_has_nothing_to_do_and_more_seeds_are_all_it_adds(done):
    file, results = done
    before = {path.stat().st_mtime_ns for path in results.glob("runs/*/evaluation.json")}
    state = studies.run_study(str(file), results_dir=results, executor=LocalExecutor(1))
    assert (state.total, state.done) == (4, 4)
    assert before == {path.stat().st_mtime_ns for path in results.glob("runs/*/evaluation.json")}
    (status,) = studies.study_status("tiny", seeds=3, results_dir=results)
    assert (status.runs, status.done, status.unrecorded) == (6, 4, 0)


def test_a_finished_study_equals_one_that_was_interrupted(done, tmp_path):
    file, results = done
    torn = tmp_path / "results"
    shutil.copytree(results, torn)
    victim = sorted((torn / "runs").iterdir())[0]
    shutil.rmtree(victim)
    studies.run_study(str(file), results_dir=torn, executor=LocalExecutor(1))

    def flights(folder):
        content = json.loads((folder / "runs" / victim.name / "evaluation.json").read_text())
        return content["pilots"][0]["episodes"]

    assert flights(torn) == flights(results)


def test_runs_of_a_version_that_recorded_no_flights_are_done_and_get_them_without_training(
    done, tmp_path
):
    file, results = done
    old = tmp_path / "results"
    shutil.copytree(results, old)
    for path in old.glob("runs/*/flights.safetensors"):
        path.unlink()
    before = {path: path.stat().st_mtime_ns for path in old.glob("runs/*/*.json*")}
    (status,) = studies.study_status(str(file), results_dir=old)
    assert (status.runs, status.done, status.unrecorded) == (4, 4, 4)
    text = studies.study_report(str(file), results_dir=old).page.read_text()
    assert "data:image/gif" not in text
    command = f"touchdown study run {file} --results-dir {old}"
    said = (
        "The flights of 4 finished runs are not recorded, so this page omits what needs them. "
        f"{command} records them without training."
    )
    assert html.escape(said) in text
    state = studies.run_study(str(file), results_dir=old, executor=LocalExecutor(1))
    assert (state.total, state.done) == (4, 4)
    assert {path: path.stat().st_mtime_ns for path in old.glob("runs/*/*.json*")} == before
    (status,) = studies.study_status(str(file), results_dir=old)
    assert status.unrecorded == 0
    again = studies.study_report(str(file), results_dir=old, force=True)
    assert "data:image/gif" in again.page.read_text()


def test_a_second_process_is_refused_before_it_changes_anything(done):
    file, results = done
    before = (results / "begun" / "tiny.json").read_bytes()
    with (
        stores.held(open_store(results)),
        pytest.raises(UserError, match="another process is running a study there"),
    ):
        studies.run_study(str(file), seeds=9, results_dir=results)
    assert (results / "begun" / "tiny.json").read_bytes() == before


def test_a_study_whose_file_was_moved_says_so_and_the_others_are_shown(
    tmp_path, monkeypatch, capsys
):
    store = open_store(tmp_path / "results", make=True)
    (tmp_path / "there").mkdir()
    monkeypatch.chdir(tmp_path / "there")
    for name in ("moved", "stays"):
        (tmp_path / "there" / f"{name}.toml").write_text(STUDY)
        with pytest.raises(Interrupted):
            studies.run_study(f"{name}.toml", executor=Stopped(), results_dir=store.path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there" / "moved.toml").rename("moved.toml")
    where = f"--results-dir={store.path}"
    app.main(["study", "status", "--json", where])
    moved, stays = json.loads(capsys.readouterr().out)
    assert (stays["name"], stays["runs"], stays["error"]) == ("stays", 4, None)
    assert (moved["name"], moved["runs"]) == ("moved", 0)
    assert "there/moved.toml: cannot be read" in moved["error"]
    app.main(["study", "status", where])
    assert "moved.toml: cannot be read" in capsys.readouterr().out
    (found,) = studies.study_status("moved.toml", results_dir=store.path)  # where it is now
    assert found.runs == 4


def test_a_stopped_study_names_the_command_that_resumes_it(done, tmp_path):
    file, _ = done
    resumes = f"resume with: touchdown study run {file} --results-dir {tmp_path}$"
    with pytest.raises(Interrupted, match=resumes):
        studies.run_study(str(file), executor=Stopped(), results_dir=tmp_path)


def test_its_report_has_figure_table_and_film(done, tmp_path):
    file, results = done
    report = studies.study_report("tiny", results_dir=results)
    text = report.page.read_text()
    assert report.page == results / "reports" / "tiny" / "index.html"
    assert text.count("<svg") >= 1
    assert "data:image/gif" in text
    where = f"--results-dir {results}"
    again = f"touchdown study run {file} {where} && touchdown study report tiny {where}"
    assert html.escape(again) in text
    links = re.findall(r'href="([^"]*learning-curve[^"]*)"', text)
    assert len(links) == 4
    assert all((report.page.parent / link).is_file() for link in links)
    elsewhere = studies.study_report("tiny", results_dir=results, out=tmp_path / "page")
    assert "learning-curve" not in elsewhere.page.read_text()
    assert f"report tiny --out {tmp_path / 'page'} {where}" in elsewhere.page.read_text()
    table = (tmp_path / "page" / "tables" / "tiny.csv").read_text().splitlines()
    assert len(table) == 5
    assert table[0].startswith("study,learning.gamma,seed,run,best_return")


def test_runs_are_compared_on_a_page(done, tmp_path):
    _, results = done
    names = sorted(path.name for path in (results / "runs").iterdir())
    page = studies.compare(names, out=tmp_path / "out", runs_dir=results / "runs")
    text = page.read_text()
    assert "4 runs of 2 settings" in text
    assert "learning.gamma" in text


def test_runs_of_several_folders_are_compared(done, tmp_path):
    _, results = done
    worst, *_, best = sorted(
        touchdown.list_runs(results / "runs"), key=lambda run: run.evaluation.summary.mean_return
    )
    shutil.copytree(best.path, tmp_path / "elsewhere" / "other")
    names = [str(worst.path), str(tmp_path / "elsewhere" / "other")]
    text = studies.compare(names, out=tmp_path / "out").read_text()
    assert "elsewhere/other/learning-curve.png" in text
    assert "data:image/gif" in text


def test_runs_of_settings_without_a_known_preset_are_compared_too(done, tmp_path):
    _, results = done
    first, second = sorted((results / "runs").iterdir())[:2]
    runs = tmp_path / "runs"
    for source in (first, second):
        shutil.copytree(source, runs / source.name)
        settings = runs / source.name / "config.toml"
        settings.write_text(settings.read_text().replace('"cartpole"', '"cartpole-tuned"'))
    page = studies.compare([first.name, second.name], out=tmp_path / "out", runs_dir=runs)
    assert "2 runs of" in page.read_text()


def test_what_is_still_to_do_is_estimated_from_the_speed_of_what_is_done(done):
    file, results = done
    found = studies.estimate_study(str(file), seeds=4, workers=2, results_dir=results)
    assert (found.missing, found.env_steps, found.measured) == (4, 6_000, 0)
    assert 0 < found.seconds < 60
    assert "4 runs of 0.0 million env steps are missing" in str(found)


def test_a_kind_of_run_that_is_not_known_is_flown_to_know_it(done, tmp_path):
    file, _ = done
    found = studies.estimate_study(str(file), workers=1, results_dir=tmp_path / "none")
    assert (found.missing, found.measured) == (4, 1)
    assert found.seconds > 0
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["study", "run", "nothing"], "study 'nothing': unknown; must be one of paper, readings"),
        (["study", "run", "nothing.toml"], "nothing.toml: cannot be read"),
        (["study", "run", "readings"], "scale = 'quick': must be full for readings"),
        (["study", "run", "ladder", "--seeds", "0"], "seeds = 0: must be from 1"),
        (["study", "run", "ladder", "--on", "mars"], "on = 'mars': must be local, ray"),
        (["study", "run", "ladder", "--workers", "0"], "workers = 0: must be from 1"),
        (["study", "status"], "has no studies"),
        (["study", "report", "--results-dir", "none"], "'none': has no studies"),
        (["compare", "nothing"], "run 'nothing': no such folder"),
        (["tune", "agent", "nothing"], "preset 'nothing': unknown"),
        (["tune", "agent", "tabular-q"], "algorithm = 'tabular': must be dqn or pqn"),
        (["tune", "agent", "pilot", "--trials", "0"], "trials = 0: must be at least 1"),
    ],
)
def test_bad_input_is_one_line_and_harms_nothing(argv, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        app.main(argv)
    complaint = capsys.readouterr().err
    assert stopped.value.code == 2
    assert said in complaint
    assert complaint.count("\n") == 1
    assert not list(tmp_path.glob("runs/studies/runs/*"))


def test_a_report_of_what_was_not_run_is_refused(tmp_path):
    open_store(tmp_path / "results", make=True)
    with pytest.raises(
        UserError, match="none of its runs is done; start it with: touchdown study run"
    ):
        studies.study_report("ladder", results_dir=tmp_path / "results")


def test_studies_are_listed_for_people_and_for_scripts(capsys):
    app.main(["study", "list"])
    assert "target-period" in capsys.readouterr().out
    app.main(["study", "list", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert [each["name"] for each in found][:2] == ["ladder", "hover"]


def test_an_agents_settings_are_searched_and_the_search_goes_on(tmp_path):
    pytest.importorskip("optuna")
    out = tmp_path / "found.toml"
    settings = {"seeds": 1, "env_steps": 1_000, "out": out, "results_dir": tmp_path / "results"}
    first = studies.tune_agent("cartpole", trials=1, executor=LocalExecutor(1), **settings)
    assert first.trials == 1
    more = studies.tune_agent(
        "cartpole", trials=2, executor=LocalExecutor(1), force=True, **settings
    )
    assert more.trials == 2
    assert more.value >= first.value
    winner = touchdown.preset("cartpole")
    from_file = toml.from_values(toml.read_toml(out), winner, out)
    assert from_file.learning.gamma == pytest.approx(more.changed["learning.gamma"])
    assert all(run.config.seed >= 10_000 for run in touchdown.list_runs(tmp_path / "results/runs"))


def test_a_second_search_is_refused_before_it_touches_a_trial(tmp_path):
    pytest.importorskip("optuna")
    with (
        stores.held(open_store(tmp_path, make=True)),
        pytest.raises(UserError, match="another process is running a study there"),
    ):
        studies.tune_agent("vector-dqn", results_dir=tmp_path)
    assert not (tmp_path / "search.sqlite3").exists()
