import shutil

import pytest

import touchdown
from small_configs import lake, tiny
from touchdown.core.errors import UserError
from touchdown.runs import folder as folders
from watched_runs import recorded_run


@pytest.fixture
def runs(tmp_path):
    recorded_run(tmp_path / "runs", "one")
    recorded_run(tmp_path / "runs", "two")
    return tmp_path / "runs"


def test_the_page_of_several_runs_is_one_file(runs, tmp_path):
    out = touchdown.watch(["one", "two", "one"], runs_dir=runs, out=tmp_path / "page.html")
    assert out == tmp_path / "page.html"
    assert "<title>2 runs</title>" in out.read_text("utf-8")


def test_an_existing_file_is_replaced_only_if_asked(runs, tmp_path):
    out = tmp_path / "page.html"
    out.write_text("mine")
    with pytest.raises(UserError, match="exists already"):
        touchdown.watch("one", runs_dir=runs, out=out)
    assert out.read_text() == "mine"
    touchdown.watch("one", runs_dir=runs, out=out, force=True)
    assert out.read_text("utf-8").startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"runs": "nope"}, "run 'nope': no such folder"),
        ({"runs": "mine.txt"}, "run 'mine.txt': is a file; must be a run's name or folder"),
        ({"runs": "one", "out": "page.pdf"}, "must end in .html"),
        ({"runs": "one", "out": "nowhere/page.html"}, "its folder does not exist"),
        ({"out": "page.html"}, "needs a run"),
        ({"runs": "one", "port": -1}, "port = -1: must be from 0 to 65535"),
        ({"runs_dir": "nothing"}, "no such folder"),
    ],
)
def test_bad_input_is_refused_before_anything_is_served(
    runs, tmp_path, monkeypatch, settings, said
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.txt").touch()
    with pytest.raises(UserError, match=said):
        touchdown.watch(**({"runs_dir": runs, "browser": False} | settings))
    assert not list(tmp_path.glob("page*"))


def test_a_study_is_watched_by_its_name(tmp_path):
    factor = touchdown.Factor.of("learning.gamma", [0.9, 0.99])
    study = touchdown.Study(name="sizes", factors=[factor], base=lake(), seeds=1)
    touchdown.run_study(study, results_dir=tmp_path / "studies", progress=False)
    out = touchdown.watch("sizes", runs_dir=tmp_path, out=tmp_path / "study.html")
    assert out is not None
    text = out.read_text("utf-8")
    assert "<title>2 runs</title>" in text
    for level in ("0.9, seed 0", "0.99, seed 0"):
        assert f'"label":"{level}"' in text


def test_policies_over_training_fly_one_start(tmp_path):
    run = touchdown.train(tiny(test_episodes=0), name="x", runs_dir=tmp_path, progress=False)
    film = tmp_path / "film.gif"
    flights = touchdown.fly_over_training(run, seed=5, out=film)
    assert film.is_file()
    saved = [policy.env_steps for policy in run.policies_over_training]
    assert flights[0].policy == "before training"
    assert flights[-1].policy == f"{saved[-1]:,} steps"
    assert {flight.seed for flight in flights} == {5}
    again = touchdown.fly(run.policies_over_training[-1].path, seed=5)
    assert flights[-1].actions.tolist() == again.actions.tolist()


def test_a_run_without_policies_over_training_is_refused(tmp_path):
    folder = folders.create(tmp_path, tiny(), "old")
    with pytest.raises(UserError, match="run 'old': saved no policies over its training"):
        touchdown.fly_over_training("old", runs_dir=tmp_path)
    with pytest.raises(UserError, match="policy 'ace': comes without its policies over training"):
        touchdown.fly_over_training("ace", runs_dir=tmp_path)
    with pytest.raises(UserError, match="policy 'pid': was not saved over training; must be a run"):
        touchdown.fly_over_training("pid", runs_dir=tmp_path)
    shutil.rmtree(folder.path)
