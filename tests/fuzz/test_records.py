"""Runs and studies with a damaged file: every verb ends with exit code 0, 2 or 130 and one line."""

import io
import os
import shutil
import time
import warnings
from contextlib import closing, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

import hypothesis
import pytest
from hypothesis import strategies as st
from mutations import damage

import touchdown
from touchdown.api.studies import comparison, report
from touchdown.cli import app
from touchdown.config.fields import with_settings
from touchdown.core.errors import Interrupted
from touchdown.core.progress import StopSignal
from touchdown.runs import folder as folders
from touchdown.training.trainer import Trainer

LONG_CASES = int(os.environ.get("TOUCHDOWN_FUZZ_CASES", "20000"))
MOST_SECONDS = 30.0  # a case takes milliseconds, but may import a library or wait for the machine

SHORT = {
    "hidden_sizes": (4,),
    "min_size": 8,
    "capacity": 64,
    "episodes": 6,
    "validation_period": 20,
    "validation_episodes": 1,
    "final_validation_episodes": 2,
    "test_episodes": 2,
    "checkpoint_seconds": 0.0,
}
LAKE = {
    "env_id": "FrozenLake-v1",
    "episodes": 20,
    "validation_period": 50,
    "validation_episodes": 1,
    "final_validation_episodes": 2,
    "test_episodes": 2,
    "checkpoint_seconds": 0.0,
}
STUDY = """
title = "Small"
question = "Which discount?"
base = "tabular-q"
seeds = 1

[config]
env_id = "FrozenLake-v1"

[config.training]
episodes = 10
validation_period = 50
validation_episodes = 1
final_validation_episodes = 2
test_episodes = 2

[[factor]]
name = "discount"
field = "learning.gamma"
values = [0.9, 0.99]
"""


@contextmanager
def _stopped_at_once(_console):
    """In place of signals: a resumed run stops as soon as it looks."""
    stop = StopSignal()
    stop.requested = True
    yield stop


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """The current folder has finished and stopped runs and a finished study, to be damaged."""
    whole = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(whole)
        touchdown.train("cartpole", name="done", progress=False, **SHORT)
        touchdown.train("tabular-q", name="lake", progress=False, **LAKE)
        for preset, name, settings in (
            ("cartpole", "stopped", SHORT),
            ("tabular-q", "table", LAKE),
        ):
            config = with_settings(touchdown.preset(preset), settings)
            asked = iter(range(1_000))
            trainer = Trainer(
                folders.create(Path("runs"), config, name),
                should_stop=lambda asked=asked: next(asked) == 3,
            )
            with closing(trainer), pytest.raises(Interrupted):
                trainer.run()
        Path("small.toml").write_text(STUDY)
        touchdown.run_study("small.toml", progress=False)
        here = tmp_path_factory.mktemp("fuzz") / "here"
        shutil.copytree(whole, here)
        patch.chdir(here)
        patch.setattr("touchdown.api.pipeline.progress.stop_on_signals", _stopped_at_once)
        # drawn from numbers that are checked by then, and far slower than reading them
        for place in (comparison, report):
            for name in ("write_comparison", "write_study_report"):
                patch.setattr(place, name, lambda *_a, **_k: here / "page", raising=False)
        yield whole


COMMANDS = {
    "runs/done": (
        ["runs"],
        ["runs", "--json"],
        ["show", "done"],
        ["show", "done", "--json"],
        ["evaluate", "done", "--episodes=1"],
        ["export", "done", "--format=safetensors", "--out=out"],
        ["compare", "done", "lake", "--out=out"],
        ["train", "--resume", "done"],
    ),
    "runs/lake": (
        ["show", "lake"],
        ["evaluate", "lake", "--episodes=1"],
        ["train", "--resume", "lake"],
    ),
    "runs/stopped": (["runs"], ["show", "stopped"], ["train", "--resume", "stopped"]),
    "runs/table": (["show", "table"], ["train", "--resume", "table"]),
    "runs/studies": (
        ["study", "status", "small.toml"],
        ["study", "status"],
        ["study", "list"],
        ["study", "report", "small.toml", "--out=out"],
    ),
}
"""What reads the files of each folder."""


def _check(whole: Path, data: st.DataObject) -> None:
    folder = data.draw(st.sampled_from(sorted(COMMANDS)))
    argv = data.draw(st.sampled_from(COMMANDS[folder]))
    files = [
        path
        for path in sorted(Path(folder).rglob("*"))
        if path.is_file() and path.suffix in (".json", ".jsonl", ".toml", ".safetensors", ".txt")
    ]
    path = data.draw(st.sampled_from(files))
    try:
        damage(data.draw, path)
        hypothesis.note(f"touchdown {' '.join(argv)}, after damage to {path}")
        _ends_in_a_line(argv)
    finally:
        shutil.rmtree(folder)
        shutil.copytree(whole / folder, folder)
        shutil.rmtree("out", ignore_errors=True)


def _ends_in_a_line(argv: list[str]) -> None:
    out, err = io.StringIO(), io.StringIO()
    code: object = 0
    began = time.monotonic()
    with redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings():
        try:
            app.main(argv)
        except SystemExit as stop:
            code = stop.code
    assert time.monotonic() - began < MOST_SECONDS
    said = err.getvalue()
    assert code in (0, 2, 130)
    assert len(said.splitlines()) == (0 if code == 0 else 1), said
    assert code == 0 or said.startswith("touchdown: ")
    for shown in (said, out.getvalue()):
        shown.encode()  # no byte that is no text
        assert "\x1b" not in shown
        assert "Traceback" not in shown


@hypothesis.settings(max_examples=150)
@hypothesis.given(data=st.data())
def test_a_damaged_record_ends_in_one_line(here, data):
    _check(here, data)


@pytest.mark.slow
@hypothesis.settings(max_examples=LONG_CASES)
@hypothesis.given(data=st.data())
def test_very_many_damaged_records_end_in_one_line(here, data):
    _check(here, data)
