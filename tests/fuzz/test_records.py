"""Runs and studies with a damaged file: every verb ends with exit code 0, 2 or 130 and one line."""

import os
import shutil
from contextlib import closing, contextmanager
from functools import cache
from pathlib import Path

import hypothesis
import pytest
from hypothesis import strategies as st
from mutations import damage
from one_line import ends_in_one_line

import touchdown
from touchdown.cli import app, parse
from touchdown.config.fields import with_settings
from touchdown.core.errors import Interrupted
from touchdown.core.progress import StopSignal
from touchdown.runs import folder as folders
from touchdown.studies.executors import outcome
from touchdown.studies.worker import attempt
from touchdown.training.trainer import Trainer

LONG_CASES = int(os.environ.get("TOUCHDOWN_FUZZ_CASES", "20000"))

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


class _InThisProcess:
    """Runs jobs one after the other; a worker process would take seconds to start."""

    workers = 1

    @staticmethod
    def run(jobs, store, on_event, should_stop) -> None:
        for job in jobs:
            ended = outcome(job, attempt(job, store, should_stop, lambda _: None))
            assert ended is not None
            on_event(ended)


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
        touchdown.run_study("small.toml", executor=_InThisProcess(), progress=False)
        here = tmp_path_factory.mktemp("fuzz") / "here"
        shutil.copytree(whole, here)
        patch.chdir(here)
        patch.setattr("touchdown.api.pipeline.progress.stop_on_signals", _stopped_at_once)
        read = cache(lambda words: parse.parse(list(words)))  # slower than what it starts
        patch.setattr(app, "parse", lambda argv: read(tuple(argv)))
        # the page is drawn, but not written: that is far slower, and knows nothing of records
        patch.setattr("touchdown.figures.style.save", lambda figure, *_, **__: figure.clear())
        patch.setattr("touchdown.report.comparison.write_page", lambda *_: None)
        patch.setattr("touchdown.report.output.write_page", lambda *_: None)
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
        ends_in_one_line(argv)
    finally:
        shutil.rmtree(folder)
        shutil.copytree(whole / folder, folder)
        shutil.rmtree("out", ignore_errors=True)


@hypothesis.settings(max_examples=50, phases=[hypothesis.Phase.generate])
@hypothesis.given(data=st.data())
def test_a_damaged_record_ends_in_one_line(here, data):
    _check(here, data)


@pytest.mark.slow
@hypothesis.settings(max_examples=LONG_CASES, phases=[hypothesis.Phase.generate])
@hypothesis.given(data=st.data())
def test_very_many_damaged_records_end_in_one_line(here, data):
    _check(here, data)
