"""Jobs that train nothing, for those who run jobs."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from touchdown.core.errors import Interrupted, UserError
from touchdown.studies.job import JobProgress


@dataclass(frozen=True)
class Chore:
    """Counts to `until` in a file, and can be gone on with; does what it is told on its way.

    `kind`: "count", "die" (in its first `times` attempts), "raise", "refuse", "full".
    """

    name: str
    kind: str = "count"
    until: int = 3
    times: int = 0
    seconds: float = 0.0

    @property
    def digest(self) -> str:
        return self.name

    @property
    def needs_flights(self) -> bool:
        return False

    def has_results(self, store: Path) -> bool:
        return self.is_done(store)

    def is_done(self, store: Path) -> bool:
        return (store / self.name / "done").is_file()

    def perform(self, store, should_stop, on_progress) -> None:
        folder = store / self.name
        folder.mkdir(parents=True, exist_ok=True)
        attempts = folder / "attempts"
        attempt = len(attempts.read_text()) if attempts.is_file() else 0
        attempts.write_text("x" * (attempt + 1))
        counted = folder / "count"
        count = int(counted.read_text()) if counted.is_file() else 0
        if self.kind == "refuse":
            raise UserError("gamma = 7: must be from 0 to 1")
        if self.kind == "raise":
            raise RuntimeError("what nobody thought of")
        if self.kind == "full":
            raise OSError(28, "No space left on device", str(counted))
        while count < self.until:
            count += 1
            counted.write_text(str(count))
            on_progress(JobProgress(count / self.until, float(count)))
            if self.kind == "die" and attempt < self.times:
                os.kill(os.getpid(), signal.SIGKILL)
            if should_stop():
                raise Interrupted
            time.sleep(self.seconds)
        (folder / "done").touch()
