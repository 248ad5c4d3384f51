"""A second process that works while the first one does, for the second core of a machine.

The two exchange lines of JSON through pipes. This module is also the program of the second process.
"""

import json
import os
import select
import signal
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib import import_module
from typing import Any, cast

from touchdown.core import processes, threads
from touchdown.core.errors import one_line

_PATIENCE = 2.0  # seconds that a helper has to leave what it is doing


class HelperError(Exception):
    """The helper could not do its work; the caller can do it, and meets the reason by itself."""


class Helper:
    """A process that calls functions of this package, one at a time.

    It ends with this object and with this process, however they end.

    Raises:
        HelperError: no process can be started.
    """

    def __init__(self) -> None:
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own program
                # without the current folder, where there may be other modules of the same names
                [sys.executable, "-P", "-m", __name__, str(os.getpid())],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
                start_new_session=True,  # Ctrl-C is handled here
                bufsize=0,
            )
        except OSError as error:
            raise HelperError(one_line(error)) from error
        self._read = b""
        self._started = self._answered = 0
        self._end = weakref.finalize(self, _end, self._process, os.getpid())

    def close(self) -> None:
        """End the process, even in the middle of a call."""
        self._end()

    def start(self, function: str, **arguments: Any) -> int:
        """Have a function called, after those that were started before.

        Args:
            function: as `package.module:name`. Beside the arguments it is given `tick`, a function
                that it may call after each part of its work.
            arguments: JSON values.

        Returns:
            The number of the call, for `result`. If the process has ended, that says so.
        """
        line = json.dumps({"function": function, "arguments": arguments}).encode() + b"\n"
        pipe: int = cast(Any, self._process.stdin).fileno() if self._end.alive else -1
        with suppress(OSError):
            while line:
                line = line[os.write(pipe, line) :]
        self._started += 1
        return self._started

    def result(self, number: int, on_tick: Callable[[], object] = lambda: None) -> Any:
        """Wait for the result of a call; the results of earlier calls are dropped.

        Args:
            number: as `start` returned it.
            on_tick: called for each call of `tick`.

        Returns:
            What it returned, as a JSON value.

        Raises:
            HelperError: it raised an exception, or the process has ended.
        """
        while True:
            for message in self._messages(0.1):
                if "tick" in message:
                    on_tick()
                    continue
                self._answered += 1
                if self._answered < number:
                    continue
                if "error" in message:
                    raise HelperError(message["error"])
                return message["result"]

    def has_done(self, number: int) -> bool:
        """Wait for a call; whether it returned without an exception."""
        try:
            self.result(number)
        except HelperError:
            return False
        return True

    def _messages(self, seconds: float) -> Iterator[dict[str, Any]]:
        """The messages that arrive within a time, or have arrived."""
        pipe: int = cast(Any, self._process.stdout).fileno() if self._end.alive else -1
        while b"\n" not in self._read:
            try:
                ready, _, _ = select.select([pipe], [], [], seconds)
                if not ready:
                    return
                part = os.read(pipe, 1 << 16)
            except (OSError, ValueError) as error:  # closed
                raise HelperError(one_line(error)) from error
            if not part:
                raise HelperError("the process has ended")
            self._read += part
        while b"\n" in self._read:
            line, _, self._read = self._read.partition(b"\n")
            yield json.loads(line)


def second_core() -> Helper | None:
    """A helper, if this process may use more than one thread and one can be started."""
    if threads.threads() < 2:
        return None
    try:
        return Helper()
    except HelperError:
        return None


def _end(process: "subprocess.Popen[bytes]", owner: int) -> None:
    """End a helper's process, unless it is that of the process we were forked from."""
    if os.getpid() != owner:
        return
    process.terminate()
    try:
        process.wait(_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            pipe.close()


def _main() -> None:
    """Call functions until standard input is closed: `PARENT`."""
    parent = int(sys.argv[1])
    # leaves every block on the way, so that nothing half written stays behind
    signal.signal(signal.SIGTERM, lambda number, _frame: processes.interrupt(number))
    threading.Thread(target=processes.end_with, args=(parent,), daemon=True).start()
    # what a library prints must not mix with our answers
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    processes.silence(sys.stdout)

    def answer(**message: Any) -> None:
        answers.write(json.dumps(message) + "\n")
        answers.flush()

    for line in sys.stdin:
        asked = json.loads(line)
        module, _, name = asked["function"].partition(":")
        try:
            function = getattr(import_module(module), name)
            answer(result=function(**asked["arguments"], tick=lambda: answer(tick=1)))
        except Exception as error:  # noqa: BLE001 - the parent does the work itself
            answer(error=one_line(error))


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):
        _main()
