"""The example of a study with claims in docs/studies.md, run as it stands but for its steps."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import touchdown
from touchdown.cli import app
from touchdown.studies.findings import VERDICTS
from touchdown.studies.study_file import from_toml

PAGE = Path(__file__).parents[2] / "docs" / "studies.md"
TINY = {
    "learning.backend": "fused",  # compiles nothing
    "replay.min_size": 100,
    "training.max_env_steps": 600,
    "training.validation_period": 300,
    "training.validation_episodes": 2,
    "training.final_validation_episodes": 2,
    "training.test_episodes": 3,
}
IN_TOML = "[config.training]\nmax_env_steps = 20_000\n"
IN_PYTHON = '{"training.max_env_steps": 20_000}'


def block(language):
    """The section's one block of code in a language."""
    (section,) = re.findall(
        r"^## Your own study with claims\n(.*?)^## ",
        PAGE.read_text("utf-8"),
        re.DOTALL | re.MULTILINE,
    )
    (code,) = re.findall(rf"^```{language}\n(.*?)^```", section, re.DOTALL | re.MULTILINE)
    return code


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of the user's own with both examples; the one in Python was run."""
    folder = tmp_path_factory.mktemp("own")
    assert IN_TOML in block("toml")
    assert IN_PYTHON in block("python")
    tiny = "".join(f"config.{name} = {value!r}\n" for name, value in TINY.items())
    # dotted names of the file's own table, so before its first table
    own_table, tables = block("toml").replace(IN_TOML, "").split("[[factor]]", 1)
    (folder / "horizon.toml").write_text(f"{own_table}{tiny}[[factor]]{tables}")
    (folder / "horizon.py").write_text(block("python").replace(IN_PYTHON, repr(TINY)))
    done = subprocess.run(
        [sys.executable, "horizon.py"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (folder / "printed").write_text(done.stdout)
    return folder


def test_the_study_in_python_runs_and_prints_its_verdicts(folder):
    lines = (folder / "printed").read_text().splitlines()
    study = from_toml(folder / "runs" / "studies" / "begun" / "horizon.toml")
    assert len(lines) == len(study.claims) == 3
    for line, claim in zip(lines, study.claims, strict=True):
        verdicts = "|".join(VERDICTS.values())
        assert re.match(rf"({verdicts}): {re.escape(claim.sentence)} \(.+\)$", line)


def test_the_same_study_in_toml_plans_the_same_runs_so_none_is_missing(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    kept = Path("runs/studies/begun/horizon.toml")
    assert from_toml(Path("horizon.toml")) == from_toml(kept)
    (status,) = touchdown.study_status("horizon.toml")
    assert (status.runs, status.done) == (30, 30)
    before = {path: path.stat().st_mtime_ns for path in Path("runs/studies/runs").rglob("*")}
    app.main(["study", "run", "horizon.toml"])
    assert "30 of 30 runs are done" in capsys.readouterr().out
    assert before == {
        path: path.stat().st_mtime_ns for path in Path("runs/studies/runs").rglob("*")
    }


def test_the_tables_have_the_columns_that_the_page_explains(folder):
    text = PAGE.read_text("utf-8")
    section = text[text.index("## Tables\n") : text.index("## Files and resuming\n")]
    own = text[text.index("## Your own study\n") : text.index("## Your own study with claims\n")]
    explained = {*re.findall(r"`([a-z0-9_%]+)`", section + own), "learning.gamma"}
    tables = folder / "runs" / "studies" / "reports" / "horizon" / "tables"
    assert {path.name for path in tables.iterdir()} == {
        "claims.csv", "horizon.csv", "horizon-levels.csv",
    }  # fmt: skip
    for path in tables.iterdir():
        columns = path.read_text("utf-8").splitlines()[0].split(",")
        assert set(columns) <= explained, path.name
