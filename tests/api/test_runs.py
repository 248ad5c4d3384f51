import io

import pytest
from rich.console import Console

import touchdown
from small_configs import tiny
from touchdown.cli import tables
from touchdown.runs.run import list_facts


def test_a_broken_run_is_listed_beside_the_whole_ones(tmp_path):
    touchdown.train(tiny(episodes=1, test_episodes=0), runs_dir=tmp_path, name="whole")
    touchdown.train(tiny(episodes=1, test_episodes=0), runs_dir=tmp_path, name="half")
    (tmp_path / "half" / "episodes.jsonl").write_text("{}\n")
    whole, half = list_facts(tmp_path)
    assert (whole["name"], whole["status"]) == ("whole", "finished")
    assert (half["name"], half["status"]) == ("half", "broken")
    assert "line 1: episode: missing" in half["error"]
    console = Console(record=True, width=120, file=io.StringIO())
    console.print(tables.runs_table([whole, half], 120))
    text = console.export_text()
    assert "finished" in text
    assert "broken" in text


def test_runs_are_listed_oldest_first(tmp_path):
    for name in ("b", "a"):
        touchdown.train(tiny("CartPole-v1", episodes=1), name=name, runs_dir=tmp_path)
    assert [run.name for run in touchdown.list_runs(tmp_path)] == ["b", "a"]


def test_a_run_is_taken_as_itself_by_its_name_and_by_its_folder(run):
    name, folder = run.name, run.path.parent
    for given in (run, name, run.path, str(run.path)):
        assert touchdown.show(given, folder) == run
    assert touchdown.show(run) is run
    assert touchdown.show(run.path) == run


def test_what_is_no_run_is_refused_in_one_line(run):
    with pytest.raises(touchdown.UserError, match="run = 3: must be a run, its name or its folder"):
        touchdown.show(3)
    with pytest.raises(touchdown.UserError, match=r"has no config\.toml"):
        touchdown.show(run.path.parent)


@pytest.mark.parametrize("way", ["run", "name", "folder"])
def test_every_function_takes_a_run_in_every_way(run, way, tmp_path):
    given = {"run": run, "name": run.name, "folder": run.path}[way]
    where = {"runs_dir": run.path.parent} if way == "name" else {}
    assert touchdown.resume(given, **where).name == run.name
    assert touchdown.fly(given, seed=1, **where).policy == run.name
    assert touchdown.evaluate(given, episodes=1, **where).name == run.name
    exported = touchdown.export(given, "safetensors", out=tmp_path / "out", **where)
    assert exported.files[0].is_file()
    assert touchdown.compare([given], out=tmp_path / "page", **where).is_file()
    assert touchdown.compare(given, out=tmp_path / "page", force=True, **where).is_file()
