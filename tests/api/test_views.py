import io
import time
from dataclasses import replace

from rich.console import Console

from touchdown.api.views import StudyView, TrainingView
from touchdown.studies.executors import Event
from touchdown.studies.job import JobProgress
from touchdown.studies.runner import State
from touchdown.training.pace import TrainingStatus

STATUS = TrainingStatus(
    episode=412,
    env_steps=98_304,
    episode_return=231.2,
    recent_return=184.9,
    epsilon=0.05,
    loss=None,
    recent_time_limit_share=0.02,
    steps_per_second=21_000,
    share_done=0.37,
    seconds_left=14,
)


def drawn(*, on_terminal: bool, status: TrainingStatus = STATUS) -> str:
    file = io.StringIO()
    console = Console(file=file, force_terminal=on_terminal, force_jupyter=False, width=100)
    with TrainingView(console, "swift-0") as view:
        view.status(status)
        if view.is_drawn:
            view._live.refresh()  # rather than wait for its thread
        view.phase("drawing", 2)
        view.advance()
        if view.is_drawn:
            view._live.refresh()
    return file.getvalue()


def test_a_run_that_may_stop_early_is_counted_to_its_limit_at_most():
    text = drawn(on_terminal=True, status=replace(STATUS, may_stop_early=True))
    assert "training swift-0 (stops once solved; at most)" in text
    assert "ETA ≤" in text


def test_training_is_drawn_on_a_terminal():
    text = drawn(on_terminal=True)
    for part in ("training swift-0", "37%", "412", "98,304", "0:14", "drawing", "1/2"):
        assert part in text


def test_a_log_gets_a_line_at_the_start_and_every_half_minute(monkeypatch):
    seconds = iter((100.0, 100.0, 129.9, 130.0, 160.0))
    monkeypatch.setattr(time, "monotonic", lambda: next(seconds))
    file = io.StringIO()
    with TrainingView(Console(file=file, force_jupyter=False, width=40), "swift-0") as view:
        for _ in range(3):
            view.status(STATUS)
        view.phase("drawing", 2)
        view.advance()
    counts = "training swift-0: 37%, 98,304 env steps, mean return of the last 100 episodes 185"
    trained = f"{counts}, ETA 0:14"
    assert file.getvalue().splitlines() == [trained, trained, "drawing: 1 of 2"]


def test_a_study_in_a_log_says_how_many_runs_are_done():
    state = State(total=8, done=3, running={"a": JobProgress(0.2)}, failed={"b": "why"})
    event = Event("advanced", "a", JobProgress(0.2))
    file = io.StringIO()
    with StudyView(Console(file=file, force_jupyter=False, width=40), "gamma", str) as view:
        view.update(state, event)
    assert file.getvalue() == "study gamma: 52%, 3 of 8 done, 1 failed\n"


def test_a_silent_console_gets_no_line():
    file = io.StringIO()
    with TrainingView(Console(file=file, quiet=True), "swift-0") as view:
        view.status(STATUS)
    assert file.getvalue() == ""
