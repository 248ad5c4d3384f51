import io
from dataclasses import replace

from rich.console import Console

from touchdown.api.views import TrainingView
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


def test_nothing_is_drawn_where_nobody_can_see_it():
    assert drawn(on_terminal=False) == ""
