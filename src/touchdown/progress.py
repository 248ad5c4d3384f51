"""What a person sees while something long runs; nothing where no terminal is watching."""

import signal
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType
from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from touchdown.errors import Interrupted
from touchdown.runs.train import Status
from touchdown.studies.executors import Event
from touchdown.studies.runner import State

_SETTLED = 0.2  # share of a training from which its recent return says something


def clock(seconds: float) -> str:
    """Seconds as m:ss or h:mm:ss."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


class StopSignal:
    """Asked whether to stop; Ctrl-C and SIGTERM make it say yes."""

    def __init__(self) -> None:
        self.requested = False

    def check(self) -> None:
        """Stop here, if asked to.

        Raises:
            Interrupted: a signal asked for it.
        """
        if self.requested:
            raise Interrupted

    def __call__(self) -> bool:
        """Whether to stop."""
        return self.requested


@contextmanager
def stop_on_signals(console: Console) -> Generator[StopSignal]:
    """Within the block, the first Ctrl-C or SIGTERM asks to stop; a second Ctrl-C stops at once.

    Outside the main thread nothing is caught: Python delivers signals there alone.
    """
    stop = StopSignal()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def handle(number: int, _frame: FrameType | None) -> None:
        if stop.requested and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop.requested = True
        console.print("stopping as soon as it can be saved (Ctrl-C again: at once)")

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _View:
    """Something live on a terminal, and nothing anywhere else."""

    def __init__(self, console: Console, live: Live) -> None:
        self._console = console
        self._live = live

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live.is_started:
            self._live.stop()


class TrainingView(_View):
    """A live view of training on a terminal, and nothing anywhere else.

    Args:
        console: where to draw.
        name: of the run.
    """

    def __init__(self, console: Console, name: str) -> None:
        super().__init__(console, Live(console=console, refresh_per_second=4))
        self._name = name
        self._phase = _counter(console)

    def status(self, status: Status) -> None:
        """Show where training stands."""
        if self._console.is_terminal:
            self._live.update(self._draw(status))

    def phase(self, text: str, count: int) -> None:
        """Show a bar of `count` flights or pictures for what comes now."""
        if self._console.is_terminal:
            for task in self._phase.task_ids:
                self._phase.remove_task(task)
            self._phase.add_task(text, total=count)
            self._live.update(self._phase)

    def advance(self) -> None:
        """One flight or picture of the phase is done."""
        for task in self._phase.task_ids:
            self._phase.advance(task)

    def _draw(self, status: Status) -> Group:
        loss = "-" if status.loss is None else f"{status.loss:.3g}"
        table = Table.grid(padding=(0, 1))
        cells = [
            ("episode", f"{status.episode}"),
            ("observations", f"{status.observations:,}"),
            ("return", f"{status.episode_return:.0f}"),
            ("mean of 100", f"{status.recent_return:.0f}"),
            ("ε", f"{status.epsilon:.3f}"),
            ("loss", loss),
            ("1000 steps", f"{status.recent_time_limit_share:.0%}"),
            ("steps/s", f"{status.steps_per_second:,.0f}"),
            ("ETA", clock(status.seconds_left)),
        ]
        for _ in cells:
            table.add_column(justify="right", no_wrap=True)
        table.add_row(*(Text(name, style="dim") for name, _ in cells))
        table.add_row(*(Text(value, style="bold") for _, value in cells))
        bar = _bar(self._console, f"training {self._name}", status.share_done)
        return Group(bar, table)


class StudyView(_View):
    """A live view of a study on a terminal; elsewhere a line for each job that fails.

    Args:
        console: where to draw.
        name: of the study.
        name_of: what a job is called, by its digest.
    """

    def __init__(self, console: Console, name: str, name_of: Callable[[str], str]) -> None:
        super().__init__(console, Live(console=console, refresh_per_second=2, transient=True))
        self._name = name
        self._name_of = name_of
        self._began = time.monotonic()
        self._first_share: float | None = None
        self._best: tuple[float, str] | None = None

    def update(self, state: State, event: Event) -> None:
        """Show where the study stands, after something has happened."""
        if self._first_share is None:
            self._first_share = state.share
        if event.kind in ("died", "failed"):
            said = f"{self._name_of(event.digest)}: {event.kind}: {event.text}"
            self._console.print(said, soft_wrap=True, markup=False, highlight=False)
        recent = event.progress.recent_return
        # the mean of few episodes is luck
        if recent is not None and event.progress.share > _SETTLED:
            self._best = max(self._best or (recent, ""), (recent, self._name_of(event.digest)))
        if self._console.is_terminal:
            self._live.update(self._draw(state))

    def _draw(self, state: State) -> Group:
        gained = state.share - (self._first_share or 0.0)
        passed = time.monotonic() - self._began
        left = clock((1 - state.share) * passed / gained) if gained > 0.001 else "-"
        bar = _bar(self._console, f"study {self._name}", state.share)
        counts = Table.grid(padding=(0, 2))
        cells = [
            ("done", f"{state.done} of {state.total}"),
            ("running", str(len(state.running))),
            ("failed", str(len(state.failed))),
            ("run again", str(state.died)),
            ("ETA", left),
        ]
        counts.add_row(*(Text(name, style="dim") for name, _ in cells))
        counts.add_row(*(Text(value, style="bold") for _, value in cells))
        running = Table.grid(padding=(0, 2))
        for digest, progress in state.running.items():
            recent = progress.recent_return
            running.add_row(
                Text(self._name_of(digest)),
                f"{progress.share:.0%}",
                "" if recent is None else f"return {recent:.0f}",
            )
        best = [Text(f"best so far: {self._best[0]:.0f}, {self._best[1]}")] if self._best else []
        return Group(bar, counts, running, *best)


def _bar(console: Console, text: str, share: float) -> Progress:
    """How much is done, from 0 to 1."""
    bar = Progress(
        TextColumn(text, markup=False),
        BarColumn(40),
        TextColumn("{task.percentage:.0f}%"),
        console=console,
    )
    bar.add_task("", total=1_000, completed=round(1_000 * share))
    return bar


@contextmanager
def counting(console: Console, text: str, total: float) -> Generator["Counter"]:
    """A progress bar with an ETA on a terminal, nothing anywhere else.

    Args:
        console: where to draw.
        text: what is being done.
        total: things to do; 1.0 shows a percentage, for work of unknown count.
    """
    counter = Counter(_counter(console, percent=total == 1.0), text, total)
    if console.is_terminal:
        with counter.bar:
            yield counter
    else:
        yield counter


class Counter:
    """A bar that is told of each thing done."""

    def __init__(self, bar: Progress, text: str, total: float) -> None:
        self.bar = bar
        self._task = bar.add_task(text, total=total)

    def __call__(self) -> None:
        """One thing is done."""
        self.bar.advance(self._task)

    def describe(self, text: str, completed: float) -> None:
        """Set the words and how far it is."""
        self.bar.update(self._task, description=text, completed=completed)


def _counter(console: Console, *, percent: bool = False) -> Progress:
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(30),
        TaskProgressColumn() if percent else MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    )
