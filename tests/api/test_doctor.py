import json
import os

import pytest

from touchdown.api import doctor
from touchdown.cli import app
from touchdown.lander import engine as engines
from touchdown.lander import rules


def findings(runs_dir) -> dict[str, doctor.Finding]:
    return {finding.name: finding for finding in doctor.check_up(runs_dir)}


def test_a_complete_installation_has_nothing_bad_and_names_its_instruction_set(tmp_path):
    found = findings(tmp_path / "runs")
    assert [name for name, finding in found.items() if finding.state == "bad"] == []
    assert "avx" in found["exact engine"].text or "baseline" in found["exact engine"].text
    assert "600 steps equal to stock's" in found["exactness"].text
    assert str(tmp_path / "runs") in found["runs"].text


def test_an_engine_that_differs_from_stock_is_bad(tmp_path, monkeypatch):
    monkeypatch.setattr(rules, "EXACT_ID", "touchdown/LunarLanderContinuous-v3")
    assert findings(tmp_path)["exactness"].state == "bad"


def test_what_is_missing_comes_with_advice(tmp_path, monkeypatch):
    monkeypatch.setattr(engines, "_built", False)
    monkeypatch.setenv("DISPLAY", "")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    found = findings(tmp_path)
    assert found["exact engine"].state == "note"
    assert "install a C++ compiler" in found["exact engine"].text
    assert "needs one" in found["window"].text


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_a_folder_that_cannot_be_written_is_bad(tmp_path):
    tmp_path.chmod(0o500)
    finding = findings(tmp_path / "runs")["runs"]
    assert finding.state == "bad"
    assert "--runs-dir" in finding.text


def test_a_file_instead_of_the_runs_folder_is_bad_and_the_verb_exits_with_2(tmp_path, capsys):
    (tmp_path / "runs").write_text("")
    with pytest.raises(SystemExit) as ended:
        app.main(["doctor", "--json", "--runs-dir", str(tmp_path / "runs")])
    assert ended.value.code == 2
    said = capsys.readouterr()
    assert said.err == "touchdown: runs: will not work; the table says how to fix it\n"
    states = {finding["name"]: finding["state"] for finding in json.loads(said.out)}
    assert states["runs"] == "bad"
    assert states["JAX"] == "good"
