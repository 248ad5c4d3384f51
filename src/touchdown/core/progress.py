"""Progress bars on a terminal and in a notebook, and stopping cleanly on Ctrl-C."""

import math
import signal
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from typing import Self

from rich.console import Console, RenderableType
from rich.live import Live
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)

from touchdown.core import notebook, processes
from touchdown.core.errors import Interrupted
from touchdown.core.terminal import make_console


def console_for(progress: bool | None, console: Console | None) -> Console:
    """The console for progress and results.

    Args:
        progress: None shows them in a notebook and on a terminal, True everywhere, False nowhere.
        console: where to show them; None uses the notebook's output or standard output.
    """
    if progress is False:
        return make_console(on_terminal=False, quiet=True)
    if console is not None:
        return console
    if notebook.in_notebook():
        return notebook.make_console()
    on_terminal = sys.stdout.isatty()
    return make_console(on_terminal=on_terminal, quiet=not (progress or on_terminal))


def clock(seconds: float) -> str:
    """Seconds as m:ss or h:mm:ss."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


class StopSignal:
    """Whether the user has asked to stop, by Ctrl-C, SIGTERM or a closed terminal."""

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
    """Within the block, Ctrl-C, SIGTERM or SIGHUP requests a stop; a second Ctrl-C forces it.

    Only the main thread catches signals.
    """
    stop = StopSignal()

    def handle(number: int) -> None:
        if stop.requested and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop.requested = True
        with suppress(OSError):  # saving matters more than saying so
            console.print("saving, then stopping (press Ctrl-C again to stop immediately)")

    with processes.stopping(handle):
        yield stop


_SILENCE = 30.0  # seconds between two lines where nothing is drawn


class View:
    """A live display on a terminal or in a notebook; elsewhere, a line every half minute.

    Args:
        console: where to draw.
        refresh_per_second: largest rate of updates.
        transient: whether to remove the display at the end.
    """

    def __init__(
        self, console: Console, *, refresh_per_second: float, transient: bool = False
    ) -> None:
        self._console = console
        self._began = time.monotonic()
        self._said: float | None = None
        self._in_notebook = console.is_jupyter and notebook.in_notebook()
        self._live = (
            notebook.Live(refresh_per_second=refresh_per_second, transient=transient)
            if self._in_notebook
            else Live(console=console, refresh_per_second=refresh_per_second, transient=transient)
        )

    @property
    def is_drawn(self) -> bool:
        """Whether the display is visible."""
        return not self._console.quiet and (self._console.is_terminal or self._in_notebook)

    def draw(self, renderable: RenderableType) -> None:
        """Replace the content."""
        if self.is_drawn:
            self._live.update(renderable)

    def say(self, line: Callable[[], str], *, at_once: bool = False) -> None:
        """Print a line, at most every half minute, where nothing is drawn: a file or a log.

        Args:
            line: makes it.
            at_once: whether the first line may come at once.
        """
        if self.is_drawn:
            return
        now = time.monotonic()
        last = -math.inf if at_once and self._said is None else self._said or self._began
        if now - last >= _SILENCE:
            self._said = now
            self._console.print(line(), soft_wrap=True)

    def __enter__(self) -> Self:
        if self.is_drawn:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live.is_started:
            self._live.stop()


def share_bar(console: Console, text: str, share: float) -> Progress:
    """A bar for a share of the work done, from 0 to 1."""
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(40),
        TextColumn("{task.percentage:.0f}%"),
        console=console,
    )
    bar.add_task(text, total=1_000, completed=round(1_000 * share))
    return bar


class Counter(View):
    """A progress bar with an ETA within a `with` block; call it once for each finished item.

    Args:
        console: where to draw.
        text: description of the work.
        total: number of items; 1.0 shows a percentage, for work that cannot be counted.
    """

    def __init__(self, console: Console, text: str, total: float) -> None:
        super().__init__(console, refresh_per_second=10, transient=True)
        self._bar = count_bar(console, percent=total == 1.0)
        self._task = self._bar.add_task(text, total=total)

    def __enter__(self) -> Self:
        super().__enter__()
        self.draw(self._bar)
        return self

    def __call__(self) -> None:
        """Count one item as finished."""
        self._bar.advance(self._task)
        self.draw(self._bar)
        self.say(lambda: count_line(self._bar))

    def describe(self, text: str, completed: float) -> None:
        """Set the bar's text and the amount done."""
        self._bar.update(self._task, description=text, completed=completed)
        self.draw(self._bar)
        self.say(lambda: count_line(self._bar))


def count_bar(console: Console, *, percent: bool = False) -> Progress:
    """A bar that counts finished items, with an ETA; `percent` is for uncountable work."""
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(30),
        TaskProgressColumn() if percent else MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
    )


def count_line(bar: Progress) -> str:
    """What a bar shows, as a line of text."""
    (task,) = bar.tasks
    done = f"{task.percentage:.0f}%"
    if task.total != 1.0:
        done = f"{task.completed:.0f} of {task.total:.0f}"
    left = task.time_remaining
    return f"{task.description}: {done}" + ("" if left is None else f", ETA {clock(left)}")
