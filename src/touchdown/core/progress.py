"""Progress bars on a terminal, and a clean stop on Ctrl-C; without a terminal nothing is drawn."""

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)

from touchdown.core.errors import Interrupted


def clock(seconds: float) -> str:
    """Seconds as m:ss or h:mm:ss."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


class StopSignal:
    """Whether the user has asked to stop, by Ctrl-C or SIGTERM."""

    def __init__(self) -> None:
        self.requested = False

    def check(self) -> None:
        """Stop here if the user has asked to.

        Raises:
            Interrupted: the user has asked to stop.
        """
        if self.requested:
            raise Interrupted

    def __call__(self) -> bool:
        """Whether the user has asked to stop."""
        return self.requested


@contextmanager
def stop_on_signals(console: Console) -> Generator[StopSignal]:
    """Within the block, the first Ctrl-C or SIGTERM requests a stop; a second Ctrl-C forces it.

    Only the main thread catches signals, as Python delivers them only to it.
    """
    stop = StopSignal()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def handle(number: int, _frame: FrameType | None) -> None:
        if stop.requested and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop.requested = True
        console.print("saving, then stopping (press Ctrl-C again to stop immediately)")

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class View:
    """A live display on a terminal; elsewhere it draws nothing."""

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


def share_bar(console: Console, text: str, share: float) -> Progress:
    """A bar for a share of the work done, from 0 to 1."""
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
    """Show a progress bar with an ETA on a terminal; elsewhere nothing is drawn.

    Args:
        console: where to draw.
        text: what is being done.
        total: number of items; 1.0 shows a percentage, for work that cannot be counted.
    """
    counter = Counter(count_bar(console, percent=total == 1.0), text, total)
    if console.is_terminal:
        with counter.bar:
            yield counter
    else:
        yield counter


class Counter:
    """A progress bar; call it once per finished item."""

    def __init__(self, bar: Progress, text: str, total: float) -> None:
        self.bar = bar
        self._task = bar.add_task(text, total=total)

    def __call__(self) -> None:
        """Count one item as done."""
        self.bar.advance(self._task)

    def describe(self, text: str, completed: float) -> None:
        """Set the bar's text and the amount done."""
        self.bar.update(self._task, description=text, completed=completed)


def count_bar(console: Console, *, percent: bool = False) -> Progress:
    """A bar that counts finished items, with an ETA; `percent` is for uncountable work."""
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(30),
        TaskProgressColumn() if percent else MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    )
