"""A worker process: one job after the other, until whoever started it is gone."""

import faulthandler
import os
import queue
import signal
import sys
import threading
import time
import traceback
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Literal

from touchdown.core.errors import Interrupted, UserError, one_line
from touchdown.studies.job import NOT_STARTED, Job, JobProgress

MOST = 1_000
_BETWEEN_WORDS = 0.5  # seconds between two reports of progress


@dataclass(frozen=True, slots=True)
class Message:
    """What a worker tells of its job."""

    kind: Literal["advanced", "done", "stopped", "refused", "unwritable", "raised"]
    progress: JobProgress = NOT_STARTED
    text: str = ""


def log_of(store: Path, job: Job) -> Path:
    """What a job's worker writes beside its results."""
    return store.parent / "logs" / f"{job.digest}.log"


class Reporter:
    """Tells of progress, but not too often."""

    def __init__(self, tell: Any) -> None:
        self._tell = tell
        self._last = -_BETWEEN_WORDS

    def __call__(self, progress: JobProgress) -> None:
        """How far the job is."""
        now = time.monotonic()
        if now - self._last >= _BETWEEN_WORDS:
            self._last = now
            self._tell(Message("advanced", progress))


def attempt(job: Job, store: Path, stop: Any, tell: Any) -> Message:
    """Do a job; gives what became of it.

    Args:
        job: to do.
        store: folder of all jobs' folders.
        stop: asked whether to stop.
        tell: told of progress.
    """
    try:
        job.perform(store, stop, Reporter(tell))
    except Interrupted:
        return Message("stopped")
    except UserError as error:
        return Message("refused", text=one_line(error))
    except OSError as error:
        where = error.filename or store
        return Message("unwritable", text=f"{where}: cannot be written: {one_line(error)}")
    except Exception as error:  # noqa: BLE001 - whatever it is, the other jobs go on
        traceback.print_exc()
        return Message("raised", text=f"{type(error).__name__}: {one_line(error)[:200]}")
    return Message("done")


def main(connection: Connection, store: Path) -> None:
    """Do the jobs that come, tell what becomes of them, and end with whoever sends them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all; the sender says what follows
    faulthandler.enable()
    jobs: queue.SimpleQueue[Job] = queue.SimpleQueue()
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda _number, _frame: stop.set())

    def listen() -> None:
        while True:
            try:
                said = connection.recv()
            except (EOFError, OSError):
                # killed perhaps: the same job may soon be begun by another process
                os._exit(1)
            if said is None:
                stop.set()
            else:
                jobs.put(said)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        job = jobs.get()
        log = log_of(store, job)
        _write_to(log)
        said = attempt(job, store, stop.is_set, connection.send)
        sys.stdout.flush()
        sys.stderr.flush()
        if said.kind == "done" and not log.stat().st_size:
            log.unlink()
        connection.send(said)


def _write_to(log: Path) -> None:
    """Have all that is printed from here on, by whatever library, go to a file."""
    log.parent.mkdir(parents=True, exist_ok=True)
    sys.stdout.flush()
    sys.stderr.flush()
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    os.dup2(file, 1)
    os.dup2(file, 2)
    os.close(file)
