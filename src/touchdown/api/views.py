"""Live views of training and of studies, on a terminal and in a notebook."""

import time
from collections.abc import Callable

from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from touchdown.core.progress import View, clock, count_bar, count_line, share_bar
from touchdown.studies.executors import Event
from touchdown.studies.runner import State
from touchdown.training.history import RECENT
from touchdown.training.pace import TrainingStatus

_PACED = 0.02  # share of training after which its pace tells how long it will take
_SETTLED = 0.2  # share of training after which the mean of recent returns is meaningful


class TrainingView(View):
    """A live view of training.

    Args:
        console: where to draw.
        name: name of the run.
    """

    def __init__(self, console: Console, name: str) -> None:
        super().__init__(console, refresh_per_second=4, transient=True)
        self._name = name
        self._phase = count_bar(console)

    def status(self, status: TrainingStatus) -> None:
        """Show the state of training."""
        if self.is_drawn:
            self.draw(self._state(status))
        self.say(
            lambda: (
                f"training {self._name}: {status.share_done:.0%}, {status.env_steps:,} env steps, "
                f"mean return of the last {min(status.episode, RECENT)} episodes "
                f"{status.recent_return:.0f}"
                # before, the pace is that of compilation
                + (f", {' '.join(_eta(status))}" if status.share_done >= _PACED else "")
            ),
            at_once=True,
        )

    def phase(self, text: str, count: int) -> None:
        """Start a phase after training, and show a bar over its `count` episodes or pictures."""
        for task in self._phase.task_ids:
            self._phase.remove_task(task)
        self._phase.add_task(text, total=count)
        self.draw(self._phase)

    def advance(self) -> None:
        """Count one episode or picture of the phase as done."""
        for task in self._phase.task_ids:
            self._phase.advance(task)
        self.draw(self._phase)
        self.say(lambda: count_line(self._phase))

    def _state(self, status: TrainingStatus) -> Group:
        loss = "-" if status.loss is None else f"{status.loss:.3g}"
        table = Table.grid(padding=(0, 1))
        cells = [
            ("episode", f"{status.episode}"),
            ("env steps", f"{status.env_steps:,}"),
            ("return", f"{status.episode_return:.0f}"),
            ("mean of 100", f"{status.recent_return:.0f}"),
            ("ε", f"{status.epsilon:.3f}"),
            ("loss", loss),
            ("timed out", f"{status.recent_time_limit_share:.0%}"),
            ("steps/s", f"{status.steps_per_second:,.0f}"),
            _eta(status),
        ]
        for _ in cells:
            table.add_column(justify="right", no_wrap=True)
        table.add_row(*(Text(name, style="dim") for name, _ in cells))
        table.add_row(*(Text(value, style="bold") for _, value in cells))
        limit = " (stops once solved; at most)" if status.may_stop_early else ""
        bar = share_bar(self._console, f"training {self._name}{limit}", status.share_done)
        return Group(bar, table)


def _eta(status: TrainingStatus) -> tuple[str, str]:
    """The time left, and how it is called: it is a bound where training may stop early."""
    return "ETA ≤" if status.may_stop_early else "ETA", clock(status.seconds_left)


class StudyView(View):
    """A live view of a study, and a line for each job that fails.

    Args:
        console: where to draw.
        name: name of the study.
        name_of: returns a job's name for its digest.
    """

    def __init__(self, console: Console, name: str, name_of: Callable[[str], str]) -> None:
        super().__init__(console, refresh_per_second=2, transient=True)
        self._name = name
        self._name_of = name_of
        self._began = time.monotonic()
        self._first_share: float | None = None
        self._best: tuple[float, str] | None = None

    def update(self, state: State, event: Event) -> None:
        """Show the state of the study after an event."""
        if self._first_share is None:
            self._first_share = state.share
        if event.kind in ("died", "failed"):
            line = f"{self._name_of(event.digest)}: {event.kind}: {event.text}"
            self._console.print(line, soft_wrap=True, markup=False, highlight=False)
        recent = event.progress.recent_return
        if recent is not None and event.progress.share > _SETTLED:
            self._best = max(self._best or (recent, ""), (recent, self._name_of(event.digest)))
        if self.is_drawn:
            self.draw(self._state(state))
        self.say(lambda: self._line(state), at_once=True)

    def _line(self, state: State) -> str:
        done = f"{state.done} of {state.total} done"
        failed = f", {len(state.failed)} failed" if state.failed else ""
        left = self._time_left(state)
        eta = f", ETA {left}" if left else ""
        return f"study {self._name}: {state.share:.0%}, {done}{failed}{eta}"

    def _time_left(self, state: State) -> str:
        """The time left as a clock; "" while there is nothing to estimate it from."""
        gained = state.share - (self._first_share or 0.0)
        passed = time.monotonic() - self._began
        return clock((1 - state.share) * passed / gained) if gained > 0.001 else ""

    def _state(self, state: State) -> Group:
        bar = share_bar(self._console, f"study {self._name}", state.share)
        counts = Table.grid(padding=(0, 2))
        cells = [
            ("done", f"{state.done} of {state.total}"),
            ("running", str(len(state.running))),
            ("failed", str(len(state.failed))),
            ("restarted", str(state.died)),
            ("ETA", self._time_left(state) or "-"),
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
