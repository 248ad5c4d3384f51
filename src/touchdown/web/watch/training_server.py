"""A server of the page beside a training, in a process of its own, so that training is not slowed.

This module is also the program of that process. It hears nothing from the training, whose records
it reads, and it ends when the training has ended and no page is open.
"""

import json
import os
import select
import subprocess
import sys
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from touchdown.core import processes
from touchdown.core.browser import open_page
from touchdown.core.errors import UserError, one_line
from touchdown.runs.folder import RunFolder

_PATIENCE = 20.0
"""Seconds that the server has to start."""
_LOWER_PRIORITY = 10
_CLOSED_SECONDS = 5.0
"""After which a page that is gone was closed, and not loaded again."""
_OPENING_SECONDS = 20.0
"""That a browser has to open the first page, if training was shorter."""
_MOST_BYTES = 10_000


@contextmanager
def watched(folder: RunFolder, *, browser: bool = True) -> Generator[str]:
    """Serve the page of a run while the block trains it, and after that while a page is open.

    Args:
        folder: the run's folder.
        browser: whether to open the page in a browser, if this machine has a display.

    Yields:
        The address of the page, which contains a secret.

    Raises:
        UserError: the server did not start.
    """
    try:
        process = subprocess.Popen(  # noqa: S603 - our own program
            # without the current folder, where there may be other modules of the same names
            [sys.executable, "-P", "-m", __name__, str(folder.path.absolute()), str(int(browser))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C ends the training, and the page shows its end
        )
    except OSError as error:
        raise UserError(f"watch: the server did not start: {one_line(error)}") from None
    assert process.stdin is not None  # noqa: S101 - they are pipes
    assert process.stdout is not None  # noqa: S101 - as above
    with process.stdin, process.stdout:  # the end of its input tells that training has ended
        ready, _, _ = select.select([process.stdout], [], [], _PATIENCE)
        answer = _parsed(process.stdout.readline(_MOST_BYTES) if ready else b"")
        if "address" not in answer:
            process.kill()
            process.wait()
            reason = answer.get("error", "no answer")
            raise UserError(f"watch: the server did not start: {reason}")
        # it outlives this block; the thread takes note of its end
        threading.Thread(target=process.wait, daemon=True).start()
        yield answer["address"]


def _parsed(line: bytes) -> dict[str, str]:
    """What the server said; nothing if it is not the server's."""
    try:
        return msgspec.json.decode(line, type=dict[str, str])
    except (msgspec.DecodeError, UnicodeDecodeError):
        return {}


class _Ending:
    """Whether the server is of no use any more.

    Args:
        stdin: descriptor that is closed when training ends.
    """

    def __init__(self, stdin: int) -> None:
        self._poll = select.poll()
        self._poll.register(stdin, 0)  # only whether the other end is closed
        self._ended: float | None = None

    def __call__(self, last_used: float | None) -> bool:
        """Whether to end, by the time at which a page was last used; None if never."""
        now = time.monotonic()
        if self._ended is None:
            if not self._poll.poll(0):
                return False
            self._ended = now
        if last_used is None:
            return now > self._ended + _OPENING_SECONDS
        return now > max(self._ended, last_used) + _CLOSED_SECONDS


def _main(folder: RunFolder, *, browser: bool) -> None:
    from touchdown.web.watch.run_index import RunIndex, key_of  # noqa: PLC0415 - as above
    from touchdown.web.watch.serving import Server  # noqa: PLC0415 - errors are reported below

    server = Server(RunIndex(folder.path.parent, [folder]))
    address = server.address_of([key_of(folder)])
    processes.print_out(json.dumps({"address": address}) + "\n")
    processes.silence(sys.stdout)
    with open_page(address if browser else None):
        server.serve(_Ending(0))


if __name__ == "__main__":
    os.nice(_LOWER_PRIORITY)
    try:
        _main(RunFolder(Path(sys.argv[1])), browser=sys.argv[2] == "1")
    except (ImportError, OSError, UserError) as error:
        processes.print_out(json.dumps({"error": one_line(error)}) + "\n")
