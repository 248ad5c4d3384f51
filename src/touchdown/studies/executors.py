"""Who runs the jobs of a study: what they tell while they do, and worker processes of this machine.

A job is done once. A worker that dies has its job run again, twice at most; what it had saved by
then is gone on with. A job that is refused would be refused again, and is not.
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
_PATIENCE = 60.0  # seconds for a worker to save and go


@dataclass(frozen=True, slots=True)
class Event:
    """What happened to a job."""

    digest: str
    kind: Literal["started", "advanced", "done", "died", "failed"]
    progress: JobProgress = NOT_STARTED
    text: str = ""
    """Why it failed, or why it is run again."""


class Executor(Protocol):
    """Does jobs side by side."""

    @property
    def workers(self) -> int:
        """Jobs at a time."""
        ...

    def run(
        self,
        jobs: Sequence[Job],
        store: Path,
        on_event: Callable[[Event], object],
        should_stop: Callable[[], bool],
    ) -> None:
        """Do all jobs that can be done.

        Args:
            jobs: in the order to begin them.
            store: folder in which each has its own in the end.
            on_event: told what happens.
            should_stop: asked now and then; True has what is under way saved.

        Raises:
            Interrupted: `should_stop` said so.
            UserError: nothing can be written any more.
        """
        ...


@dataclass(slots=True)
class Attempts:
    """How often each job has been begun."""

    _begun: dict[str, int] = field(default_factory=dict[str, int])

    def begin(self, job: Job) -> None:
        """Once more."""
        self._begun[job.digest] = self.of(job.digest) + 1

    def of(self, digest: str) -> int:
        """How often a job has been begun."""
        return self._begun.get(digest, 0)

    def after_death(self, job: Job, why: str, waiting: deque[Job]) -> Event:
        """What to tell of a worker's death; a job that may be run again is the next to be begun."""
        if self.of(job.digest) > RERUNS:
            return Event(job.digest, "failed", text=f"{why}, {RERUNS + 1} times")
        waiting.appendleft(job)
        return Event(job.digest, "died", text=f"{why}; run again")


def outcome(job: Job, said: Message) -> Event | None:
    """The end of a job that is done or refused; None of one that is neither."""
    if said.kind == "done":
        return Event(job.digest, "done", JobProgress(1.0))
    if said.kind == "refused":
        return Event(job.digest, "failed", text=said.text)
    return None


class _Worker:
    """A process that does one job at a time."""

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
        """End it, at once."""
        self.process.kill()
        self.process.join()
        self.connection.close()


class LocalExecutor:
    """Worker processes of this machine, one thread each.

    Args:
        workers: how many; as many as there are cores if None.
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
        """Do all jobs that can be done; see `Executor`."""
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
            # each gets one thread: that is the fastest for many small trainings side by side
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
        """Give out jobs, and hear what has happened."""
        for each in self._workers:
            if each.job is None and self._waiting:
                job = self._waiting.popleft()
                self._attempts.begin(job)
                each.give(job)
                self._on_event(Event(job.digest, "started"))
        for each, said in self._received():
            if said is None:
                self._replace(each)
            else:
                self._hear(each, said)

    def _received(self) -> Iterator[tuple[_Worker, Message | None]]:
        """What busy workers say within a while; None of one that is dead."""
        connections = {each.connection: each for each in self._busy()}
        for ready in connection.wait(list(connections), _BETWEEN_LOOKS):
            each = connections[ready]  # pyright: ignore[reportArgumentType] - one of its keys
            try:
                yield each, each.connection.recv()
            except (EOFError, ConnectionError):
                yield each, None

    def _hear(self, each: _Worker, said: Message) -> None:
        job = each.job
        if job is None:
            return
        if said.kind == "advanced":
            self._on_event(Event(job.digest, "advanced", said.progress))
            return
        each.job = None
        if (ended := outcome(job, said)) is not None:
            self._on_event(ended)
        elif said.kind == "unwritable":
            self._full = said.text
        elif said.kind == "raised":
            self._again(job, said.text)

    def _again(self, job: Job, why: str) -> None:
        told = f"{why}; {worker.log_of(self._store, job)}"
        self._on_event(self._attempts.after_death(job, told, self._waiting))

    def _replace(self, dead: _Worker) -> None:
        """Put a new worker in the place of one that has died."""
        dead.process.join(_PATIENCE)
        job, code = dead.job, dead.process.exitcode
        dead.close()
        self._workers[self._workers.index(dead)] = _Worker(self._store)
        if job is not None:
            self._again(job, f"its worker died (exit code {code})")

    def _stop(self) -> None:
        """Have all that is under way saved."""
        until = time.monotonic() + _PATIENCE
        for each in self._busy():
            try:
                each.connection.send(None)
            except (BrokenPipeError, ConnectionError):
                each.job = None
        while self._busy() and time.monotonic() < until:
            for each, said in self._received():
                if said is not None and said.kind == "done":
                    self._hear(each, said)
                elif said is None or said.kind != "advanced":
                    each.job = None
