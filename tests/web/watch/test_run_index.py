import os
from pathlib import Path

import pytest

from small_configs import tiny
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.web.watch.run_index import RunIndex, StudyRuns, key_of


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    for name in ("old", "new"):
        folders.create(tmp_path / "runs", tiny(), name)
    os.utime(tmp_path / "runs" / "old" / "config.toml", (1, 1))
    return tmp_path / "runs"


def labels(index: RunIndex) -> list[str]:
    return [run["label"] for run in index.listing()]


def test_the_newest_run_comes_first_and_those_under_way_before_it(runs):
    assert labels(RunIndex(runs)) == ["new", "old"]
    with folders.lock(RunFolder(runs / "old")):
        found = RunIndex(runs).listing()
    assert [(run["label"], run["status"]) for run in found] == [
        ("old", "training"),
        ("new", "stopped"),
    ]


def test_a_run_with_broken_settings_is_damaged_until_they_are_mended(runs):
    config = runs / "new" / "config.toml"
    whole = config.read_text()
    config.write_text("seed = 'x'")
    index = RunIndex(runs)
    assert {run["label"]: run["status"] for run in index.listing()} == {
        "new": "damaged",
        "old": "stopped",
    }
    config.write_text(whole)
    assert {run["status"] for run in index.listing()} == {"stopped"}


def test_a_key_is_no_path_and_leads_to_its_run_alone(runs):
    index = RunIndex(runs)
    run = index.find(key_of(RunFolder(runs / "old")))
    assert run is not None
    assert run.folder.path == runs / "old"
    assert int(run.key, 16) >= 0
    for key in ("old", "../runs/old", str(runs / "old"), "", run.key.upper() + "0"):
        assert index.find(key) is None


def test_a_link_out_of_the_folder_is_not_shown_unless_the_user_names_it(runs, tmp_path):
    outside = folders.create(tmp_path / "elsewhere", tiny(), "outside")
    (runs / "link").symlink_to(outside.path)
    assert labels(RunIndex(runs)) == ["new", "old"]
    assert "link" in labels(RunIndex(runs, [RunFolder(runs / "link")]))
    assert "outside" in labels(RunIndex(runs, [outside]))


def test_runs_of_studies_have_the_names_of_their_levels(runs):
    store = runs / "studies" / "runs"
    for name in ("abc", "def"):
        folders.create(store, tiny(), name)
    studies = StudyRuns(store, {"sizes": {"abc": "wide, seed 0"}})
    found = {run.label: run.group for run in RunIndex(runs, (), lambda: studies).all()}
    assert found == {"new": "", "old": "", "wide, seed 0": "sizes", "def": "other studies"}


def test_a_new_run_is_found_and_a_deleted_one_is_not(runs, monkeypatch):
    index = RunIndex(runs)
    index.all()
    later = folders.create(runs, tiny(), "later")
    assert index.find(key_of(later)) is None  # the listing is used for a second
    monkeypatch.setattr("time.monotonic", lambda: 1e9)
    assert index.find(key_of(later)) is not None


def test_a_folder_without_runs_has_an_empty_list(tmp_path):
    assert RunIndex(tmp_path / "nothing").listing() == []
