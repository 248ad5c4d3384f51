import io

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
    console.print(tables.runs_table([whole, half]))
    text = console.export_text()
    assert "finished" in text
    assert "broken" in text


def test_runs_are_listed_oldest_first(tmp_path):
    for name in ("b", "a"):
        touchdown.train(tiny("CartPole-v1", episodes=1), name=name, runs_dir=tmp_path)
    assert [run.name for run in touchdown.list_runs(tmp_path)] == ["b", "a"]
