"""Executors run the jobs of a study and report events; the local one uses worker processes.

A job is done once. If a worker dies, its job is run again, at most twice, from its last saved
state. A job that fails with a `UserError` is not retried, as it would fail again.
"""

import multiprocessing
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing import connection
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any, Literal, Protocol, cast

from touchdown.core import threads
from touchdown.core.errors import Interrupted, UserError
from touchdown.studies import worker
from touchdown.studies.job import NOT_STARTED, Job, JobProgress
from touchdown.studies.worker import Message

RERUNS = 2
_BETWEEN_LOOKS = 0.25  # seconds
_PATIENCE = 60.0  # seconds for a worker to save and exit


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a job."""

    digest: str
    kind: Literal["started", "advanced", "done", "died", "failed"]
    progress: JobProgress = NOT_STARTED
    text: str = ""
    """Reason for a failure or rerun."""


class Executor(Protocol):
    """Runs jobs in parallel."""

    @property
    def workers(self) -> int:
        """Number of parallel jobs."""
        ...

    def run(
        self,
        jobs: Sequence[Job],
        store: Path,
        on_event: Callable[[Event], object],
        should_stop: Callable[[], bool],
    ) -> None:
        """Run all jobs that can be run.

        Args:
            jobs: jobs in the order to start them.
            store: folder in which each finished job has its own folder.
            on_event: called with each event.
            should_stop: called regularly; True saves unfinished jobs and stops.

        Raises:
            Interrupted: `should_stop` returned True.
            UserError: results can no longer be written.
        """
        ...


@dataclass(slots=True)
class Attempts:
    """Counts how often each job was started."""

    _begun: dict[str, int] = field(default_factory=dict[str, int])

    def begin(self, job: Job) -> None:
        """Count one more start."""
        self._begun[job.digest] = self.of(job.digest) + 1

    def of(self, digest: str) -> int:
        """Number of starts of a job."""
        return self._begun.get(digest, 0)

    def after_death(self, job: Job, why: str, waiting: deque[Job]) -> Event:
        """The event of a worker's death; a job that may be rerun is started next."""
        if self.of(job.digest) > RERUNS:
            return Event(job.digest, "failed", text=f"{why}, {RERUNS + 1} times")
        waiting.appendleft(job)
        return Event(job.digest, "died", text=f"{why}; run again")


def outcome(job: Job, message: Message) -> Event | None:
    """The final event of a done or failed job; None for other messages."""
    if message.kind == "done":
        return Event(job.digest, "done", JobProgress(1.0))
    if message.kind == "refused":
        return Event(job.digest, "failed", text=message.text)
    return None


class _Worker:
    """A process that runs one job at a time."""

    def __init__(self, store: Path) -> None:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        self.connection = cast("Connection[Any, Any]", ours)
        self.process: SpawnProcess = context.Process(
            target=worker.main, args=(theirs, store), daemon=True
        )
        self.process.start()
        theirs.close()
        self.job: Job | None = None

    def give(self, job: Job) -> None:
        self.job = job
        self.connection.send(job)

    def close(self) -> None:
        """End it at once."""
        self.process.kill()
        self.process.join()
        self.connection.close()


class LocalExecutor:
    """Worker processes of this machine, one thread each.

    Args:
        workers: number of processes; None uses one per core.
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = threads.available() if workers is None else workers
        if not 1 <= self.workers <= worker.MOST:
            raise UserError(f"workers = {workers}: must be from 1 to {worker.MOST}")

    def run(
        self,
        jobs: Sequence[Job],
        store: Path,
        on_event: Callable[[Event], object],
        should_stop: Callable[[], bool],
    ) -> None:
        """Run all jobs that can be run; see `Executor`."""
        _LocalRun(min(self.workers, len(jobs)), jobs, store, on_event).finish(should_stop)


class _LocalRun:
    def __init__(
        self,
        workers: int,
        jobs: Sequence[Job],
        store: Path,
        on_event: Callable[[Event], object],
    ) -> None:
        self._waiting = deque(jobs)
        self._store = store
        self._on_event = on_event
        self._attempts = Attempts()
        self._count = workers
        self._workers: list[_Worker] = []
        self._full: str | None = None

    def finish(self, should_stop: Callable[[], bool]) -> None:
        try:
            # one thread each is fastest for many small training runs in parallel
            with threads.one_thread_each():
                self._workers = [_Worker(self._store) for _ in range(self._count)]
                while self._waiting or self._busy():
                    if should_stop():
                        self._stop()
                        raise Interrupted
                    self._look()
                    if self._full is not None:
                        self._stop()
                        raise UserError(self._full)
        finally:
            for each in self._workers:
                each.close()

    def _busy(self) -> list[_Worker]:
        return [each for each in self._workers if each.job is not None]

    def _look(self) -> None:
        """Assign jobs to workers and handle their reports."""
        for each in self._workers:
            if each.job is None and self._waiting:
                job = self._waiting.popleft()
                self._attempts.begin(job)
                self._on_event(Event(job.digest, "started"))
                try:
                    each.give(job)
                except OSError:  # it was killed while it waited
                    self._replace(each)
        for each, message in self._received():
            if message is None:
                self._replace(each)
            else:
                self._hear(each, message)

    def _received(self) -> Iterator[tuple[_Worker, Message | None]]:
        """Messages that busy workers send within a short time; None from a dead worker."""
        connections = {each.connection: each for each in self._busy()}
        for ready in connection.wait(list(connections), _BETWEEN_LOOKS):
            each = connections[ready]  # pyright: ignore[reportArgumentType] - one of its keys
            try:
                yield each, each.connection.recv()
            except (EOFError, ConnectionError):
                yield each, None

    def _hear(self, each: _Worker, message: Message) -> None:
        job = each.job
        if job is None:
            return
        if message.kind == "advanced":
            self._on_event(Event(job.digest, "advanced", message.progress))
            return
        each.job = None
        if (ended := outcome(job, message)) is not None:
            self._on_event(ended)
        elif message.kind == "unwritable":
            self._full = message.text
        elif message.kind == "raised":
            self._again(job, message.text)

    def _again(self, job: Job, why: str) -> None:
        reason = f"{why}; {worker.log_of(self._store, job)}"
        self._on_event(self._attempts.after_death(job, reason, self._waiting))

    def _replace(self, dead: _Worker) -> None:
        """Replace a worker that has died."""
        dead.process.join(_PATIENCE)
        job, code = dead.job, dead.process.exitcode
        dead.close()
        self._workers[self._workers.index(dead)] = _Worker(self._store)
        if job is not None:
            self._again(job, f"its worker died (exit code {code})")

    def _stop(self) -> None:
        """Have workers save their unfinished jobs."""
        until = time.monotonic() + _PATIENCE
        for each in self._busy():
            try:
                each.connection.send(None)
            except (BrokenPipeError, ConnectionError):
                each.job = None
        while self._busy() and time.monotonic() < until:
            for each, message in self._received():
                if message is not None and message.kind == "done":
                    self._hear(each, message)
                elif message is None or message.kind != "advanced":
                    each.job = None
