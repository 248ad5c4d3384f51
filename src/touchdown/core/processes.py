"""Signals, and processes that must not outlive their parent."""

import multiprocessing
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import IO

_STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that ask a program to save and end: Ctrl-C, `kill`, and a terminal that was closed."""


@contextmanager
def stopping(on_signal: Callable[[int], object]) -> Generator[None]:
    """Within the block, call a function on Ctrl-C, SIGTERM and SIGHUP instead of ending.

    Only the main thread catches signals, as Python delivers them only to it. A signal that the
    program was started to ignore, as by `nohup`, is still ignored.

    Args:
        on_signal: called with the number of the signal.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    # seen now, because a closed terminal is none any more
    terminals = [stream for stream in (sys.stdout, sys.stderr) if stream.isatty()]

    def handle(number: int, _frame: FrameType | None) -> None:
        if number == signal.SIGHUP:
            for stream in terminals:
                silence(stream)  # a closed terminal refuses all output
        on_signal(number)

    before = {number: signal.getsignal(number) for number in _STOPPING}
    # one that is not Python's, which is None, could not be put back
    caught = [n for n, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    for number in caught:
        signal.signal(number, handle)
    try:
        yield
    finally:
        for number in caught:
            signal.signal(number, before[number])


def interrupt(_number: int) -> None:
    """Stop at once, as Ctrl-C does.

    Raises:
        KeyboardInterrupt: always.
    """
    raise KeyboardInterrupt


def open_closed_streams() -> None:
    """Lead the standard streams that the caller closed nowhere.

    Otherwise they are None, and the next file that is opened has the descriptor that libraries
    write to.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            stream = Path(os.devnull).open(mode, encoding="utf-8")  # noqa: SIM115 - it stays open
            setattr(sys, name, stream)


def silence(stream: IO[str]) -> None:
    """Send a stream's further output nowhere."""
    with suppress(OSError, ValueError):  # a stream without a file
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def print_out(text: str) -> None:
    """Write to standard output; nothing further if its reader has left, as `head` does."""
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        silence(sys.stdout)


def leave_stopping_to_the_parent() -> None:
    """In a worker process: ignore signals that also reach its parent, and end with the parent.

    Ctrl-C and a closed terminal reach all processes; the parent tells its workers what to do.
    """
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def end_with_it() -> None:
        parent.join()
        # at once: another process may soon start the same job
        os._exit(1)

    threading.Thread(target=end_with_it, daemon=True).start()


def end_with(parent: int) -> None:
    """In a process with a pipe as standard input: end when the one that started it does.

    It returns never, so it needs a thread of its own.

    Args:
        parent: number of the process that started this one.
    """
    poll = select.poll()
    poll.register(0, 0)  # only whether the other end is closed
    while os.getppid() == parent and not poll.poll(500):
        pass
    os._exit(1)
