"""Runs the jobs of a study on a Ray cluster; records return through Ray, without a shared disk.

A node works in its own folder. After each checkpoint it sends the run's complete folder to the
machine that runs the study. If a node is lost, its jobs continue elsewhere from that folder.
"""

import io
import logging
import os
import shutil
import tarfile
import tempfile
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, cast

import ray
from ray.exceptions import RayError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from touchdown.core import files
from touchdown.core.errors import Interrupted, UserError, one_line
from touchdown.studies.executors import Attempts, Event, outcome
from touchdown.studies.job import Job
from touchdown.studies.worker import Message, attempt

_BETWEEN_LOOKS = 0.5  # seconds
_BETWEEN_SENDS = 5.0  # seconds between sending two folders of one job
_PATIENCE = 60.0  # seconds for saving unfinished jobs


class RayExecutor:
    """Runs jobs on a Ray cluster with one CPU each.

    Args:
        address: `ray` for the cluster that this machine belongs to, or `ray://host:port`.
        workers: parallel jobs; None uses one per CPU of the cluster.

    Raises:
        UserError: the cluster cannot be reached.
    """

    def __init__(self, address: str = "ray", workers: int | None = None) -> None:
        if workers is not None and workers < 1:
            raise UserError(f"workers = {workers}: must be at least 1")
        if not ray.is_initialized():
            _connect("auto" if address == "ray" else address)
        self._workers = workers

    @property
    def workers(self) -> int:
        """Number of parallel jobs; nodes may join and leave."""
        if self._workers is not None:
            return self._workers
        return max(1, int(ray.cluster_resources().get("CPU", 1)))

    def run(
        self,
        jobs: Sequence[Job],
        store: Path,
        on_event: Callable[[Event], object],
        should_stop: Callable[[], bool],
    ) -> None:
        """Run all jobs that can be run; see `Executor`."""
        _RayRun(jobs, store, on_event, lambda: self.workers).finish(should_stop)


def _connect(address: str) -> None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the error below has the same content
            ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except (ConnectionError, RuntimeError, ValueError, OSError, RayError) as error:
        raise UserError(
            f"on = {address!r}: no cluster can be reached: {one_line(error)[:200]}; check that it "
            "runs, and that this machine has its token (RAY_AUTH_MODE=token; `ray get-auth-token` "
            "on the head prints it)"
        ) from None
    if os.environ.get("RAY_AUTH_MODE", "").lower() != "token":  # Ray sets it if it finds a token
        warnings.warn(
            "this Ray cluster has no token: whoever reaches its ports can run commands on its "
            "machines; see docs/cluster.md",
            stacklevel=2,
        )


class _Mailbox:
    """Receives messages of nodes: an actor on the study's own machine, which outlives them."""

    def __init__(self) -> None:
        self._messages: list[tuple[str, int, Message]] = []
        self._folders: dict[str, tuple[int, bytes]] = {}
        self._stop = False

    def tell(self, digest: str, number: int, message: Message) -> bool:
        """Receive a message about a job; return whether the job must stop."""
        self._messages.append((digest, number, message))
        return self._stop

    def send(self, digest: str, number: int, folder: bytes) -> bool:
        """Receive a job's folder; that of a later attempt replaces an earlier one."""
        if number >= self._folders.get(digest, (0, b""))[0]:
            self._folders[digest] = (number, folder)
        return self._stop

    def stop(self) -> None:
        """Stop every job at its next message."""
        self._stop = True

    def collect(self) -> tuple[list[tuple[str, int, Message]], dict[str, bytes]]:
        """Messages and folders received since the last call."""
        messages, self._messages = self._messages, []
        folders, self._folders = self._folders, {}
        return messages, {digest: folder for digest, (_, folder) in folders.items()}


def _work(job: Job, number: int, folder: bytes | None, mailbox: Any) -> tuple[Message, bytes]:
    """Do a job on a node; return how it ended, and its folder."""
    os.environ["OMP_NUM_THREADS"] = "1"
    stop = threading.Event()
    over = threading.Event()
    with tempfile.TemporaryDirectory(prefix="touchdown-") as name:
        store = Path(name) / "runs"
        store.mkdir()
        if folder is not None:
            _unpack(folder, store / job.digest)

        def send() -> None:
            newest = None
            while not over.wait(_BETWEEN_SENDS):
                seen = _newest(store / job.digest)
                if seen is None or seen == newest:
                    continue
                packed = _pack(store / job.digest)
                # a checkpoint that has just been replaced is sent next time
                if packed is not None and _newest(store / job.digest) == seen:
                    newest = seen
                    if ray.get(mailbox.send.remote(job.digest, number, packed)):
                        stop.set()

        def tell(message: Message) -> None:
            if ray.get(mailbox.tell.remote(job.digest, number, message)):
                stop.set()

        sender = threading.Thread(target=send, daemon=True)
        sender.start()
        message = attempt(job, store, stop.is_set, tell)
        over.set()
        sender.join()
        return message, _pack(store / job.digest) or b""


class _RayRun:
    def __init__(
        self,
        jobs: Sequence[Job],
        store: Path,
        on_event: Callable[[Event], object],
        workers: Callable[[], int],
    ) -> None:
        self._waiting = deque(jobs)
        self._store = store
        self._on_event = on_event
        self._workers = workers
        self._attempts = Attempts()
        self._running: dict[Any, Job] = {}
        self._refused: str | None = None
        here = ray.get_runtime_context().get_node_id()
        # with a soft affinity Ray could place it on another node and lose it with that node
        strategy = NodeAffinitySchedulingStrategy(here, soft=False)
        self._mailbox: Any = (
            ray.remote(_Mailbox).options(num_cpus=0, scheduling_strategy=strategy).remote()
        )
        # retries are decided here, where the saved state of the job is known
        self._work: Any = ray.remote(_work).options(num_cpus=1, max_retries=0)

    def finish(self, should_stop: Callable[[], bool]) -> None:
        try:
            while self._waiting or self._running:
                if should_stop():
                    self._stop()
                    raise Interrupted
                self._begin()
                self._look(_BETWEEN_LOOKS)
                if self._refused is not None:
                    self._stop()
                    raise UserError(self._refused)
        finally:
            for task in self._running:
                ray.cancel(task, force=True)
            ray.kill(self._mailbox)

    def _begin(self) -> None:
        while self._waiting and len(self._running) < self._workers():
            job = self._waiting.popleft()
            self._attempts.begin(job)
            number = self._attempts.of(job.digest)
            folder = _pack(self._store / job.digest)
            self._running[self._work.remote(job, number, folder, self._mailbox)] = job
            self._on_event(Event(job.digest, "started"))

    def _look(self, seconds: float) -> None:
        ready = cast(Any, ray).wait(list(self._running), timeout=seconds, num_returns=1)[0]
        self._collect()
        for task in ready:
            job = self._running.pop(task)
            try:
                message, folder = cast(tuple[Message, bytes], ray.get(task))
            except RayError as error:
                self._again(job, f"its node was lost ({type(error).__name__})")
            else:
                self._end(job, message, folder)

    def _collect(self) -> None:
        """Handle messages from nodes."""
        messages, folders = ray.get(self._mailbox.collect.remote())
        for digest, folder in folders.items():
            self._unpack(folder, digest)
        for digest, number, each in messages:
            # messages of a lost node may arrive after its job was started elsewhere
            if number == self._attempts.of(digest) and each.kind == "advanced":
                self._on_event(Event(digest, "advanced", each.progress))

    def _end(self, job: Job, message: Message, folder: bytes) -> None:
        if folder:
            self._unpack(folder, job.digest)
        if (ended := outcome(job, message)) is not None:
            self._on_event(ended)
        elif message.kind in ("raised", "unwritable"):
            self._again(job, message.text)

    def _again(self, job: Job, why: str) -> None:
        self._on_event(self._attempts.after_death(job, why, self._waiting))

    def _unpack(self, folder: bytes, digest: str) -> None:
        try:
            _unpack(folder, self._store / digest)
        except OSError as error:
            self._refused = f"{self._store / digest}: cannot be written: {one_line(error)}"

    def _stop(self) -> None:
        """Make nodes save their unfinished jobs and send them here."""
        self._waiting.clear()
        ray.get(self._mailbox.stop.remote())
        until = time.monotonic() + _PATIENCE
        while self._running and time.monotonic() < until:
            self._look(_BETWEEN_LOOKS)
            self._waiting.clear()


def _newest(folder: Path) -> str | None:
    """The name of a run's newest checkpoint."""
    checkpoints = folder / "checkpoints"
    if not checkpoints.is_dir():
        return None
    found = [path.name for path in checkpoints.iterdir() if path.name.isdecimal()]
    return max(found, key=int, default=None)


def _pack(folder: Path) -> bytes | None:
    """A folder's files as a tar archive; None if there is none, or a file has just vanished."""
    if not folder.is_dir():
        return None
    buffer = io.BytesIO()
    try:
        with tarfile.open(fileobj=buffer, mode="w") as archive:
            for path in sorted(folder.rglob("*")):
                inner = path.relative_to(folder)
                hidden = any(part.startswith(".") for part in inner.parts)
                if path.is_file() and not hidden and path.name != "lock":
                    archive.add(path, inner.as_posix(), recursive=False)
    except FileNotFoundError:
        return None
    return buffer.getvalue()


def _unpack(packed: bytes, folder: Path) -> None:
    """Replace a folder by a packed one, atomically.

    Raises:
        OSError: it cannot be written; the old folder is kept.
    """
    old = folder.with_name(f".{folder.name}.{os.getpid()}.old.tmp")

    def fill(temporary: Path) -> None:
        with tarfile.open(fileobj=io.BytesIO(packed), mode="r") as archive:
            archive.extractall(temporary, filter="data")

    folder.parent.mkdir(parents=True, exist_ok=True)
    if folder.exists():
        folder.replace(old)
    try:
        files.write_folder_atomic(folder, fill)
    except OSError:
        if old.exists():
            old.replace(folder)
        raise
    finally:
        shutil.rmtree(old, ignore_errors=True)
