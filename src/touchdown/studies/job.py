"""What can be done by whoever does jobs: workers load no more than this before they begin."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a job is, for whoever watches."""

    share: float
    recent_return: float | None = None


BEGUN = Progress(0.0)


class Job(Protocol):
    """Something to do once, that can be gone on with, into a folder of its own."""

    @property
    def digest(self) -> str:
        """What it is known by, and what its folder is called."""
        ...

    def is_done(self, store: Path) -> bool:
        """Whether its folder holds its results."""
        ...

    def perform(
        self,
        store: Path,
        should_stop: Callable[[], bool],
        on_progress: Callable[[Progress], object],
    ) -> None:
        """Do what is missing.

        Args:
            store: folder of all jobs' folders.
            should_stop: asked now and then; True saves and raises `Interrupted`.
            on_progress: told now and then.

        Raises:
            Interrupted: `should_stop` said so.
            UserError: it cannot be done, and would not the next time.
        """
        ...
