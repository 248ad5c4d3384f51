"""A worker process: runs one job after the other until its parent process ends."""

import errno
import faulthandler
import os
import queue
import signal
import sys
import threading
import time
import traceback
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Literal

from touchdown.core import processes
from touchdown.core.errors import Interrupted, UserError, one_line
from touchdown.studies.job import NOT_STARTED, Job, JobProgress

MOST = 1_000
_BETWEEN_WORDS = 0.5  # seconds between two reports of progress


@dataclass(frozen=True, slots=True)
class Message:
    """A worker's report on its job."""

    kind: Literal["advanced", "done", "stopped", "refused", "unwritable", "raised"]
    progress: JobProgress = NOT_STARTED
    text: str = ""


def log_of(store: Path, job: Job) -> Path:
    """The log file of a job's worker."""
    return store.parent / "logs" / f"{job.digest}.log"


class Reporter:
    """Reports progress at limited intervals."""

    def __init__(self, tell: Any) -> None:
        self._tell = tell
        self._last = -_BETWEEN_WORDS

    def __call__(self, progress: JobProgress) -> None:
        """Report the progress of the job."""
        now = time.monotonic()
        if now - self._last >= _BETWEEN_WORDS:
            self._last = now
            self._tell(Message("advanced", progress))


def attempt(job: Job, store: Path, stop: Any, tell: Any) -> Message:
    """Do a job, and return how it ended.

    Args:
        job: the job to do.
        store: folder of all jobs' folders.
        stop: returns whether to stop.
        tell: called with progress messages.
    """
    try:
        if not store.is_dir():  # moved or deleted: nothing is created in its former place
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(store))
        job.perform(store, stop, Reporter(tell))
    except Interrupted:
        return Message("stopped")
    except UserError as error:
        return Message("refused", text=one_line(error))
    except OSError as error:
        where = error.filename or store
        return Message("unwritable", text=f"{where}: cannot be written: {one_line(error)}")
    except Exception as error:  # noqa: BLE001 - any error of one job leaves the others running
        traceback.print_exc()
        return Message("raised", text=f"{type(error).__name__}: {one_line(error)[:200]}")
    return Message("done")


def main(connection: Connection, store: Path) -> None:
    """Do the jobs that arrive and report on them, until the sending process ends."""
    processes.leave_stopping_to_the_parent()
    faulthandler.enable()
    jobs: queue.SimpleQueue[Job] = queue.SimpleQueue()
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda _number, _frame: stop.set())

    def listen() -> None:
        while True:
            try:
                message = connection.recv()
            except (EOFError, OSError):
                os._exit(1)  # the parent has ended
            if message is None:
                stop.set()
            else:
                jobs.put(message)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        job = jobs.get()
        log = log_of(store, job)
        with suppress(OSError):  # without the log, the job still says why it fails
            _write_to(log)
        message = attempt(job, store, stop.is_set, connection.send)
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
            if message.kind == "done" and not log.stat().st_size:
                log.unlink()
        connection.send(message)


def _write_to(log: Path) -> None:
    """Redirect all further output, from any library, to a file."""
    log.parent.mkdir(exist_ok=True)
    sys.stdout.flush()
    sys.stderr.flush()
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    os.dup2(file, 1)
    os.dup2(file, 2)
    os.close(file)
