"""The protocol of a job; workers import only this module before they start."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol


@dataclass(frozen=True, slots=True)
class JobProgress:
    """Progress of a job."""

    share: float
    """Share that is done, from 0 to 1."""
    recent_return: float | None = None


NOT_STARTED = JobProgress(0.0)


class Job(Protocol):
    """A unit of work that can be stopped and resumed, with its own folder."""

    @property
    def digest(self) -> str:
        """Identifier of the job and name of its folder."""
        ...

    @property
    def needs_flights(self) -> bool:
        """Whether it is not done without its recorded flights, if it has results from elsewhere."""
        ...

    def has_results(self, store: Path) -> bool:
        """Whether its folder has its results; recorded flights may still be missing."""
        ...

    def is_done(self, store: Path) -> bool:
        """Whether its folder has all its files."""
        ...

    def perform(
        self,
        store: Path,
        should_stop: Callable[[], bool],
        on_progress: Callable[[JobProgress], object],
    ) -> None:
        """Do the missing parts.

        Args:
            store: folder of all jobs' folders.
            should_stop: called regularly; True saves and raises `Interrupted`.
            on_progress: called regularly.

        Raises:
            Interrupted: `should_stop` returned True.
            UserError: it cannot be done, and retrying would not help.
        """
        ...
