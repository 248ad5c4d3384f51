"""The number of threads of a process. Results do not depend on it."""

import os
from collections.abc import Generator
from contextlib import contextmanager


def available() -> int:
    """The number of cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def threads() -> int:
    """The number of threads to use: OMP_NUM_THREADS if it is set, else the number of cores."""
    wanted = os.environ.get("OMP_NUM_THREADS", "")
    return int(wanted) if wanted.isdecimal() and int(wanted) > 0 else available()


@contextmanager
def one_thread_each() -> Generator[None]:
    """Processes started within the block use one thread, unless OMP_NUM_THREADS is already set."""
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    try:
        yield
    finally:
        if before is None:
            del os.environ["OMP_NUM_THREADS"]
