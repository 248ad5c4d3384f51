"""Lets one thread at a time use an environment."""

import os
import threading


class Turn:
    """A context manager that one thread at a time may enter; others are refused, not kept waiting.

    Waiting would make results depend on which thread comes first. It would never end in a process
    that was forked while another thread, which the fork does not copy, was inside.

    Raises:
        RuntimeError: another thread is inside, or was when this process was forked.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._pid = os.getpid()

    def __enter__(self) -> None:
        if self._lock.acquire(blocking=False):
            return
        if self._pid != os.getpid():
            raise RuntimeError(
                "this process was forked while another thread used this environment: make a new "
                "one, or fork before"
            )
        raise RuntimeError("another thread is using this environment: give each thread its own")

    def __exit__(self, *_: object) -> None:
        self._lock.release()
