import json
from pathlib import Path

from touchdown.cli import app


def test_runs_and_show_print_json_for_scripts(finished, capsys):
    app.main(["runs", "--json", f"--runs-dir={finished}"])
    listed = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in listed] == ["cart"]
    assert listed[0]["status"] == "finished"
    assert listed[0]["episodes"] == 8
    app.main(["show", "cart", "--json", f"--runs-dir={finished}"])
    shown = json.loads(capsys.readouterr().out)
    assert shown["config"]["env_id"] == "CartPole-v1"
    assert all(Path(path).is_file() for path in shown["pictures"])
    app.main(["show", "cart", f"--runs-dir={finished}"])
    text = capsys.readouterr().out
    assert 'env_id = "CartPole-v1"' in text
    heading = "run preset env seed status episodes env steps minutes test"
    assert heading.split() == text.split()[: len(heading.split())]
    assert text.index("learning-curve.png") < text.index("[network]")
    assert "[rollout]" not in text  # which its algorithm does not use


def test_a_list_of_runs_says_where_those_of_studies_are(tmp_path, capsys):
    (tmp_path / "studies" / "runs").mkdir(parents=True)
    app.main(["runs", f"--runs-dir={tmp_path}"])
    where = tmp_path / "studies" / "runs"
    assert f"runs of studies: touchdown runs --runs-dir {where}\n" in capsys.readouterr().out
