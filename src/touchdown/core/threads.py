"""How many threads one process may use, where no result depends on it."""

import os
from collections.abc import Generator
from contextlib import contextmanager


def available() -> int:
    """The cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def threads() -> int:
    """As many as OMP_NUM_THREADS says, or else as there are cores."""
    told = os.environ.get("OMP_NUM_THREADS", "")
    return int(told) if told.isdecimal() and int(told) > 0 else available()


@contextmanager
def one_thread_each() -> Generator[None]:
    """Within the block, processes that are started use one thread, unless told otherwise before."""
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    try:
        yield
    finally:
        if before is None:
            del os.environ["OMP_NUM_THREADS"]
