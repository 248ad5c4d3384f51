import base64
import os

import pytest

from finished_runs import write_run
from touchdown.config.config import Config
from touchdown.config.toml import to_toml
from touchdown.runs import run as runs
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import CURVE, Run

PNG = b"\x89PNG made up"


@pytest.fixture
def run(tmp_path) -> Run:
    path = tmp_path / "<b>abc"
    write_run(path)
    (path / CURVE).write_bytes(PNG)
    folder = RunFolder(path)
    folder.config_file.write_text(to_toml(Config(preset="pilot", seed=7)))
    return Run(folder)


def test_a_finished_run_is_told_in_a_line(run):
    assert repr(run) == "<Run <b>abc: LunarLander-v3, finished, test return 200.0 (n=2)>"


def test_a_finished_run_shows_its_facts_beside_its_curve(run):
    shown = run._repr_html_()
    assert f'src="data:image/png;base64,{base64.b64encode(PNG).decode()}"' in shown
    for name, value in (
        ("preset", "pilot"),
        ("training seed", "7"),
        ("environment steps", "4,000"),
        ("training time", "0:40"),
        ("return, mean ± sd", "200.0 ± 141"),
    ):
        assert f">{name}</td>" in shown
        assert f">{value}</td>" in shown


def test_a_name_cannot_add_markup(run):
    shown = run._repr_html_()
    assert "<b>" not in shown
    assert "<strong>&lt;b&gt;abc</strong>: LunarLander-v3, finished" in shown


def test_a_run_in_training_says_so_and_shows_what_it_has(run):
    (run.path / CURVE).unlink()
    run.folder.evaluation.unlink()
    assert repr(run) == "<Run <b>abc: LunarLander-v3, training not finished>"
    shown = run._repr_html_()
    assert "training not finished" in shown
    assert ">4,000</td>" in shown
    assert "<img" not in shown
    run.folder.episodes.unlink()
    assert ">0</td>" in run._repr_html_()


def test_a_run_without_test_episodes_is_finished_all_the_same(run):
    run.folder.evaluation.unlink()
    assert repr(run) == "<Run <b>abc: LunarLander-v3, finished, not tested>"


@pytest.mark.parametrize("name", ["config.toml", "evaluation.json"])
def test_a_broken_run_says_what_is_broken(run, name):
    (run.path / name).write_text("<i>[")
    assert repr(run).startswith("<Run <b>abc: broken: ")
    assert name in repr(run)
    assert "\n" not in repr(run)
    shown = run._repr_html_()
    assert "broken: " in shown
    assert "<i>" not in shown
    assert "<b>" not in shown


def test_broken_lines_leave_the_line_and_break_the_table(run):
    run.folder.episodes.write_text("{}\n")
    assert "finished" in repr(run)
    assert "broken: " in run._repr_html_()


def test_a_run_that_was_deleted_says_so(run):
    for path in sorted(run.path.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    run.path.rmdir()
    assert "broken: " in repr(run)
    assert "broken: " in run._repr_html_()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_run_that_may_not_be_read_says_so(run):
    run.path.chmod(0)
    assert "broken: " in repr(run)
    run.path.chmod(0o700)


def test_a_curve_that_no_run_draws_is_left_out(run, monkeypatch):
    monkeypatch.setattr(runs, "_MOST_BYTES", len(PNG) - 1)
    assert "<img" not in run._repr_html_()
