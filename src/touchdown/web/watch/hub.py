"""Reads each watched run once, and tells every page that shows it what is new."""

import asyncio
import time
from collections.abc import AsyncGenerator, Sequence
from contextlib import suppress
from typing import Any

from touchdown.web.watch.records import Cursor, WatchedRun
from touchdown.web.watch.run_index import RunIndex

HEARTBEAT_SECONDS = 10.0
"""After which a page hears that the server is still there."""
_TICK_SECONDS = 0.1
MOST_RUNS = 500
"""On one page."""


class Hub:
    """The runs that pages show now.

    Args:
        index: where runs are found.
    """

    def __init__(self, index: RunIndex) -> None:
        self._index = index
        self._runs: dict[str, WatchedRun] = {}
        self._pages: dict[str, int] = {}
        self._open = 0
        self._asked: float | None = None
        self._changed = asyncio.Event()
        self._closed = False
        self.failure: Exception | None = None
        """What ended the reading of runs; the server is of no use any more."""

    @property
    def last_used(self) -> float | None:
        """When a page was last open or asked for something, on the monotonic clock; None if never.

        It is now while a page follows runs.
        """
        return time.monotonic() if self._open else self._asked

    def note_request(self) -> None:
        """Take note that a page asks for something."""
        self._asked = time.monotonic()

    def close(self) -> None:
        """End all streams of messages."""
        self._closed = True
        self._wake()

    async def follow(self, keys: Sequence[str]) -> AsyncGenerator[dict[str, Any] | None]:
        """The messages to one page: all that is known, then what is new, until the page closes.

        Args:
            keys: the runs that it shows.

        Yields:
            A message, or None when there was none for some time.
        """
        cursors = {key: Cursor() for key in keys}
        self._open += 1
        for key in cursors:
            self._pages[key] = self._pages.get(key, 0) + 1
        try:
            for key in cursors:
                if await self._find(key) is None:
                    yield {"run": key, "facts": None}
            while not self._closed:
                changed = self._changed
                for key, cursor in cursors.items():
                    run = await self._find(key)
                    for message in () if run is None else run.since(cursor):
                        yield message
                with suppress(TimeoutError):
                    await asyncio.wait_for(changed.wait(), HEARTBEAT_SECONDS)
                if not changed.is_set():
                    yield None
        finally:
            self._open -= 1
            self._asked = time.monotonic()
            for key in cursors:
                self._pages[key] -= 1
                if not self._pages[key]:
                    del self._pages[key]
                    self._runs.pop(key, None)  # whoever comes next reads it anew

    async def poll(self) -> None:
        """Read what pages show, again and again, until cancelled or `failure` is set."""
        try:
            while True:
                await asyncio.sleep(_TICK_SECONDS)
                await self._read_due()
        except Exception as error:  # noqa: BLE001 - whoever serves raises it
            self.failure = error
            self.close()

    async def _read_due(self) -> None:
        is_new = False
        for run in [run for run in self._runs.values() if run.is_due]:
            is_new = run.take(await asyncio.to_thread(run.read)) or is_new
        if is_new:
            self._wake()

    def _wake(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()

    async def _find(self, key: str) -> WatchedRun | None:
        if key not in self._runs:  # a search takes long where there are many runs
            found = await asyncio.to_thread(self._index.find, key)
            if found is not None:
                run = WatchedRun(found.folder, found.key, found.label, found.group)
                self._runs.setdefault(key, run)  # another page may have found it meanwhile
        return self._runs.get(key)
