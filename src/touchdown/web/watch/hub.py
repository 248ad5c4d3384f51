"""Reads each watched run once, and tells every page that shows it what is new."""

import asyncio
from collections.abc import AsyncGenerator, Sequence
from contextlib import suppress
from typing import Any

from touchdown.web.watch.records import Cursor, WatchedRun
from touchdown.web.watch.shelf import Shelf

HEARTBEAT_SECONDS = 10.0
"""After which a page hears that the server is still there."""
_TICK_SECONDS = 0.1
MOST_RUNS = 500
"""On one page."""


class Hub:
    """The runs that pages show now.

    Args:
        shelf: where runs are found.
    """

    def __init__(self, shelf: Shelf) -> None:
        self._shelf = shelf
        self._runs: dict[str, WatchedRun] = {}
        self._pages: dict[str, int] = {}
        self._changed = asyncio.Event()
        self._closed = False

    @property
    def pages(self) -> int:
        """Number of open pages, at least of those that show a run."""
        return self._pages.get("", 0)

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
        watched = ["", *dict.fromkeys(keys)]
        for key in watched:
            self._pages[key] = self._pages.get(key, 0) + 1
        try:
            cursors = {key: Cursor() for key in watched[1:]}
            for key in cursors:
                if self._find(key) is None:
                    yield {"run": key, "facts": None}
            while not self._closed:
                changed = self._changed
                for key, cursor in cursors.items():
                    run = self._find(key)
                    for message in () if run is None else run.since(cursor):
                        yield message
                with suppress(TimeoutError):
                    await asyncio.wait_for(changed.wait(), HEARTBEAT_SECONDS)
                if not changed.is_set():
                    yield None
        finally:
            for key in watched:
                self._pages[key] -= 1
                if not self._pages[key]:
                    del self._pages[key]
                    self._runs.pop(key, None)  # whoever comes next reads it anew

    async def poll(self) -> None:
        """Read what pages show, again and again, until cancelled."""
        while True:
            await asyncio.sleep(_TICK_SECONDS)
            is_new = False
            for run in [run for run in self._runs.values() if run.is_due]:
                is_new = run.take(await asyncio.to_thread(run.read)) or is_new
            if is_new:
                self._wake()

    def _wake(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()

    def _find(self, key: str) -> WatchedRun | None:
        if key not in self._runs and (found := self._shelf.find(key)) is not None:
            self._runs[key] = WatchedRun(found.folder, found.key, found.label, found.group)
        return self._runs.get(key)
