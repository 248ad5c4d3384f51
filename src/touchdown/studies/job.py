"""What an executor can do: workers load no more than this before they start."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol


@dataclass(frozen=True, slots=True)
class JobProgress:
    """How much of a job is done."""

    share: float
    """From 0 to 1."""
    recent_return: float | None = None


NOT_STARTED = JobProgress(0.0)


class Job(Protocol):
    """Something to do once, which can be stopped and resumed, into a folder of its own."""

    @property
    def digest(self) -> str:
        """What identifies the job; its folder has this name."""
        ...

    def has_results(self, store: Path) -> bool:
        """Whether its folder holds its numbers; recorded flights may still be missing."""
        ...

    def is_done(self, store: Path) -> bool:
        """Whether its folder holds all its files."""
        ...

    def perform(
        self,
        store: Path,
        should_stop: Callable[[], bool],
        on_progress: Callable[[JobProgress], object],
    ) -> None:
        """Do what is missing.

        Args:
            store: folder of all jobs' folders.
            should_stop: asked now and then; True saves and raises `Interrupted`.
            on_progress: called now and then.

        Raises:
            Interrupted: `should_stop` returned True.
            UserError: it cannot be done, and trying again would not help.
        """
        ...
