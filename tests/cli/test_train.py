import shutil
import signal
import subprocess
import sys
import time
from typing import get_args

import pytest

from command_line import SHORT, complaint
from touchdown.api import training
from touchdown.cli import app
from touchdown.cli.parse import parse
from touchdown.core import files
from touchdown.training.services import LoggerName


def test_a_run_ends_with_its_records_results_and_pictures(finished):
    names = {path.name for path in (finished / "cart").iterdir()}
    assert {
        "config.toml",
        "provenance.json",
        "episodes.jsonl",
        "updates.jsonl",
        "validations.jsonl",
        "evaluation.json",
        "checkpoints",
        "learning-curve.png",
        "flight.gif",
        "flight.mp4",
    } <= names
    assert not [name for name in names if ".tmp" in name]


def test_a_run_whose_name_is_taken_again_loses_nothing(finished, capsys):
    before = {p: p.read_bytes() for p in (finished / "cart").rglob("*") if p.is_file()}
    said = complaint("train", *SHORT, "--name=cart", f"--runs-dir={finished}", capsys=capsys)
    assert "--resume cart" in said
    assert before == {p: p.read_bytes() for p in (finished / "cart").rglob("*") if p.is_file()}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_an_interrupted_run_says_how_to_continue_and_does(tmp_path, number):
    runs = tmp_path / "runs"
    args = ["train", "dqn", *SHORT, "--episodes=60", "--name=stop", f"--runs-dir={runs}"]
    child = subprocess.Popen(
        [sys.executable, "-m", "touchdown", *args], stderr=subprocess.PIPE, text=True
    )
    episodes = runs / "stop" / "episodes.jsonl"
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and child.poll() is None:
        if episodes.is_file() and episodes.read_bytes().count(b"\n") >= 3:
            break
        time.sleep(0.01)
    child.send_signal(number)
    _, said = child.communicate(timeout=120)
    assert child.returncode == 130
    assert said.splitlines()[-1] == (
        "touchdown: stopped and saved; "
        f"resume with: touchdown train --resume stop --runs-dir {runs}"
    )
    app.main(["train", "--resume", "stop", f"--runs-dir={runs}"])
    assert [row["episode"] for row in files.read_jsonl(episodes)] == list(range(1, 61))


def test_loggers_are_handed_on_to_train_and_to_resume(monkeypatch, tmp_path):
    given = []
    for name in ("train", "resume"):
        monkeypatch.setattr(training, name, lambda *_, logger, **__: given.append(logger))
    app.main(["train", "dqn", "--logger", *get_args(LoggerName), f"--runs-dir={tmp_path}"])
    app.main(["train", "--resume=mine", "--logger", "mlflow"])
    app.main(["train"])
    assert given == [("wandb", "mlflow"), ("mlflow",), ()]


def test_an_unknown_logger_is_refused(capsys):
    said = complaint("train", "--logger", "tensorbord", capsys=capsys)
    assert "wandb" in said
    assert "mlflow" in said
    with pytest.raises(SystemExit):
        parse(["train", "--help"])
    assert "--logger" in capsys.readouterr().out


def test_a_finished_run_is_not_resumed_but_said_to_be_finished(finished, tmp_path, capsys):
    runs = tmp_path / "runs"
    shutil.copytree(finished, runs)
    app.main(["train", "dqn", "--resume=cart", f"--runs-dir={runs}"])
    assert capsys.readouterr().out.splitlines()[0] == "cart: finished already"


def test_a_preset_other_than_the_runs_is_refused_with_resume(finished, capsys):
    said = complaint("train", "pilot", "--resume=cart", f"--runs-dir={finished}", capsys=capsys)
    assert said == "preset 'pilot': run 'cart' was started with 'dqn'; leave the preset out"
    said = complaint("train", "dqn", "--gamma=0.5", "--resume=cart", capsys=capsys)
    assert said.startswith("resume 'cart': a run resumes with its own settings")
