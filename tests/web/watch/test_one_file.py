import json
import re
import shutil

import pytest

from touchdown.core.errors import UserError
from touchdown.web.watch import one_file
from touchdown.web.watch.one_file import write_page
from touchdown.web.watch.run_index import RunIndex, key_of
from watched_runs import append, flight


def element(html: str, name: str):
    found = re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', html)
    assert found
    return json.loads(found[1])


@pytest.fixture
def written(run, tmp_path):
    """Writes the page of the run; gives its data, its files and its HTML."""

    def write():
        out = tmp_path / "page.html"
        write_page(RunIndex(run.path.parent), [key_of(run)], out)
        html = out.read_text("utf-8")
        return element(html, "data"), element(html, "binaries"), html

    return write


def test_the_file_contains_records_policies_and_episodes(run, written):
    data, binaries, _ = written()
    key = key_of(run)
    assert set(binaries) == {"lander.wasm", f"{key}/0", f"{key}/300"}
    assert data["episodes"] == {f"{key}/2": flight(2)}
    assert data["live"] is False
    columns = {m["record"]: m["columns"] for m in data["messages"] if m.get("columns")}
    assert columns["episodes"]["episode"] == [1, 2, 3]
    assert columns["updates"]["loss"] == [0.5]


def test_the_file_needs_nothing_from_anywhere(written):
    html = written()[2]
    assert "./static/" not in html
    assert not re.search(r"<(script|link|img)[^>]*(src|href)=\"(?!data:)", html)


def test_what_is_too_much_for_a_file_is_left_out_evenly(run, written, monkeypatch):
    for steps in (600, 900, 1200):
        (run.over_training / f"{steps:08d}.safetensors").write_bytes(b"weights..")
    append(run.training_flights, *(flight(number) for number in range(3, 12)))
    monkeypatch.setattr(one_file, "MOST_BYTES", 3 * len(b"weights 0"))
    data, _, _ = written()
    assert data["messages"][0]["facts"]["policies"] == [0, 600, 1200]
    kept = [row["episode"] for row in data["episodes"].values()]
    assert (kept[0], kept[-1]) == (2, 11)
    assert sum(len(row["actions"]) for row in data["episodes"].values()) <= one_file.MOST_BYTES


@pytest.mark.parametrize("damage", [b"", None])
def test_a_damaged_policy_does_not_harm_the_others(run, written, damage):
    first = run.over_training / "00000000.safetensors"
    first.unlink()
    if damage is None:
        first.symlink_to("00000300.safetensors")
    else:
        first.write_bytes(damage)
    assert f"{key_of(run)}/300" in written()[1]


def test_a_run_that_saved_only_its_best_policy_has_that(run, written):
    shutil.rmtree(run.over_training)
    run.best.write_bytes(b"best")
    assert f"{key_of(run)}/best" in written()[1]


def test_a_damaged_record_is_told_in_the_file(run, written):
    append(run.updates, {"update": "x"})
    data, _, _ = written()
    assert "updates.jsonl: line 2" in data["messages"][0]["facts"]["error"]


def test_a_run_with_broken_settings_is_refused_and_nothing_is_written(run, written, tmp_path):
    run.config_file.write_text("seed = 'x'")
    with pytest.raises(UserError, match=r"config.toml: seed = 'x': must be a whole number"):
        written()
    assert not list(tmp_path.glob("*.html"))


def test_a_deleted_run_is_refused_and_nothing_is_written(run, tmp_path):
    index = RunIndex(run.path.parent)
    index.all()
    shutil.rmtree(run.path)
    with pytest.raises(UserError, match="run 'watched': was deleted"):
        write_page(index, [key_of(run)], tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()
