"""Serves the pages on 127.0.0.1 until it is stopped."""

import asyncio
import os
import socket
import time
from collections.abc import Callable

import uvicorn

from touchdown.core.errors import UserError, one_line
from touchdown.web.watch.access import new_token
from touchdown.web.watch.app import make_app
from touchdown.web.watch.hub import Hub
from touchdown.web.watch.run_index import RunIndex

HOST = "127.0.0.1"
_CLOSING_SECONDS = 2
"""That open connections have when the server stops."""
_LOOK_SECONDS = 0.2
_MOST_CONNECTIONS = 256
"""A page keeps one open, and several while it loads."""
_LAST_PORT = 65_535
ShouldEnd = Callable[[float | None], bool]


class Server:
    """A server that listens, and does not answer before `serve`.

    Args:
        index: the runs that it may show.
        port: number of the port; 0 takes a free one.

    Raises:
        UserError: the port is taken or not allowed.
    """

    def __init__(self, index: RunIndex, port: int = 0) -> None:
        if not 0 <= port <= _LAST_PORT:
            raise UserError(f"port = {port}: must be from 0 to {_LAST_PORT}")
        try:
            self._socket = socket.create_server((HOST, port))
        except OSError as error:
            reason = os.strerror(error.errno) if error.errno else one_line(error)
            raise UserError(
                f"port = {port}: cannot be used: {reason}; choose another, or leave it out"
            ) from None
        self._index = index
        self.port: int = self._socket.getsockname()[1]
        self.token = new_token()

    @property
    def address(self) -> str:
        """The address of the list of runs, which contains the token."""
        return f"http://{HOST}:{self.port}/{self.token}/"

    def address_of(self, keys: list[str]) -> str:
        """The address of the page of some runs; of the list if there are none."""
        return self.address + ("?" + "&".join(f"run={key}" for key in keys) if keys else "")

    def serve(self, should_end: ShouldEnd = lambda _last_used: False) -> None:
        """Answer requests until Ctrl-C or SIGTERM.

        Args:
            should_end: called several times in a second with the time at which a page was last used
                on the monotonic clock, None if never; whether to stop.
        """
        hub = Hub(self._index)
        config = uvicorn.Config(
            make_app(self._index, hub, self.token),
            log_level="critical",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=_CLOSING_SECONDS,
            http="h11",
            loop="asyncio",
            ws="none",
            limit_concurrency=_MOST_CONNECTIONS,
        )
        _Uvicorn(config, hub, should_end).run(sockets=[self._socket])
        if hub.failure is not None:
            raise hub.failure


class _Uvicorn(uvicorn.Server):
    """Uvicorn, which ends streams when it stops, instead of waiting for them."""

    def __init__(self, config: uvicorn.Config, hub: Hub, should_end: ShouldEnd) -> None:
        super().__init__(config)
        self._hub = hub
        self._should_end = should_end
        self._next_look = 0.0

    async def on_tick(self, counter: int) -> bool:
        """Whether to stop; called ten times in a second."""
        if time.monotonic() >= self._next_look:
            self._next_look = time.monotonic() + _LOOK_SECONDS
            is_over = self._hub.failure is not None or self._should_end(self._hub.last_used)
            self.should_exit = self.should_exit or is_over
        return await super().on_tick(counter)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams, then as always."""
        self._hub.close()
        await asyncio.sleep(0)
        await super().shutdown(sockets)
