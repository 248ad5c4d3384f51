import errno
import json
import os

import pytest

from single_changes import is_refused_in_a_line, single_changes
from touchdown.core.errors import UserError
from touchdown.studies import store as stores
from touchdown.studies.store import StartedStudy, open_store


def test_a_folder_of_results_is_made_and_found_again(tmp_path):
    made = open_store(tmp_path / "a" / "b", make=True)
    assert made == open_store(tmp_path / "a" / "b")


def test_a_folder_of_another_version_is_refused_and_left_as_it_is(tmp_path):
    open_store(tmp_path, make=True)
    mark = tmp_path / "studies.json"
    mark.write_text(json.dumps({"format_version": 9}))
    with pytest.raises(UserError, match="format_version = 9: must be 1 in this version"):
        open_store(tmp_path, make=True)
    assert json.loads(mark.read_text()) == {"format_version": 9}


def test_a_folder_of_other_things_is_not_taken(tmp_path):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(UserError, match="contains other files"):
        open_store(tmp_path, make=True)
    with pytest.raises(UserError, match="has no studies"):
        open_store(tmp_path)


def test_a_folder_that_a_killed_start_half_made_is_known_again(tmp_path):
    (tmp_path / ".studies.12-0.tmp.json").touch()
    (tmp_path / "runs").mkdir()  # former versions made it first
    store = open_store(tmp_path, make=True)
    assert store == open_store(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["runs", "studies.json"]


def test_on_a_full_disk_the_folder_is_left_for_another_try(tmp_path, monkeypatch):
    def full(_descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    for calls in range(4):
        results = tmp_path / str(calls)
        with monkeypatch.context() as patch:
            flush = iter([os.fsync] * calls + [full] * 9)
            patch.setattr(os, "fsync", lambda descriptor, flush=flush: next(flush)(descriptor))
            with pytest.raises(UserError, match="cannot be written: No space left on device"):
                open_store(results, make=True)
        assert open_store(results, make=True).runs.is_dir()


def test_why_a_job_failed_is_remembered_until_it_is_tried_again(tmp_path):
    store = open_store(tmp_path, make=True)
    assert store.failed() == {}
    store.note_failure("abc", "it diverged")
    assert store.failed() == {"abc": "it diverged"}
    store.forget_failure("abc")
    assert store.failed() == {}


def test_how_a_study_was_last_run_is_remembered(tmp_path):
    store = open_store(tmp_path, make=True)
    begun = StartedStudy("ladder", "full", 7, None)
    stores.note_started(store, StartedStudy("ladder", "quick", 3, None))
    stores.note_started(store, begun)
    assert stores.list_started(store) == ["ladder"]
    assert stores.read_started(store, "ladder") == begun
    assert stores.read_started(store, "another") is None


def test_one_wrong_value_in_what_is_remembered_is_reported_in_one_line(tmp_path):
    store = open_store(tmp_path, make=True)
    store.note_failure("abc", "it diverged")
    stores.note_started(store, StartedStudy("ladder", "full", 7, None))

    def read_all() -> None:
        open_store(tmp_path)
        store.failed()
        stores.read_started(store, "ladder")

    for name in ("studies.json", "failed/abc.json", "begun/ladder.json"):
        path = tmp_path / name
        record = json.loads(path.read_text())
        refused = 0
        for other in single_changes(record):
            path.write_text(json.dumps(other))
            refused += is_refused_in_a_line(
                lambda: (
                    open_store(tmp_path),
                    store.failed(),
                    stores.read_started(store, "ladder"),
                ),
                str(path),
            )
        assert refused > 10
        path.write_text(json.dumps(record))
