"""Serves the pages on 127.0.0.1 until it is told to stop."""

import asyncio
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import uvicorn

from touchdown.core.errors import UserError, one_line
from touchdown.web.watch.access import new_token
from touchdown.web.watch.app import make_app
from touchdown.web.watch.hub import Hub
from touchdown.web.watch.shelf import Shelf

HOST = "127.0.0.1"
_CLOSING_SECONDS = 2
"""That open connections have when the server stops."""
_LOOK_SECONDS = 0.2
_LAST_PORT = 65_535


@dataclass(frozen=True, slots=True)
class Server:
    """A server that listens, and does not answer before `serve`.

    Args:
        shelf: the runs that it may show.
        port: number of the port; 0 takes a free one.

    Raises:
        UserError: the port is taken or not allowed.
    """

    shelf: Shelf
    port: int = 0
    token: str = field(default_factory=new_token, repr=False)
    _socket: socket.socket = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not 0 <= self.port <= _LAST_PORT:
            raise UserError(f"port = {self.port}: must be from 0 to {_LAST_PORT}")
        try:
            listening = socket.create_server((HOST, self.port))
        except OSError as error:
            raise UserError(
                f"port = {self.port}: cannot be used: {one_line(error)}; "
                "choose another, or leave it out"
            ) from None
        object.__setattr__(self, "_socket", listening)
        object.__setattr__(self, "port", listening.getsockname()[1])

    @property
    def address(self) -> str:
        """The address of the list of runs, which contains the token."""
        return f"http://{HOST}:{self.port}/{self.token}/"

    def address_of(self, keys: list[str]) -> str:
        """The address of the page of some runs; of the list if there are none."""
        return self.address + ("?" + "&".join(f"run={key}" for key in keys) if keys else "")

    def serve(self, should_end: Callable[[int], bool] = lambda _pages: False) -> None:
        """Answer requests until Ctrl-C or SIGTERM.

        Args:
            should_end: called several times in a second with the number of open pages; whether to
                stop.
        """
        hub = Hub(self.shelf)
        config = uvicorn.Config(
            make_app(self.shelf, hub, self.token),
            log_level="critical",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=_CLOSING_SECONDS,
            http="h11",
            loop="asyncio",
            ws="none",
        )
        _Uvicorn(config, hub, should_end).run(sockets=[self._socket])

    def close(self) -> None:
        """Stop listening; of a server that never served."""
        self._socket.close()


class _Uvicorn(uvicorn.Server):
    """Uvicorn, which ends streams when it stops, instead of waiting for them."""

    def __init__(self, config: uvicorn.Config, hub: Hub, should_end: Callable[[int], bool]) -> None:
        super().__init__(config)
        self._hub = hub
        self._should_end = should_end
        self._next_look = 0.0

    async def on_tick(self, counter: int) -> bool:
        """Whether to stop; called ten times in a second."""
        if time.monotonic() >= self._next_look:
            self._next_look = time.monotonic() + _LOOK_SECONDS
            self.should_exit = self.should_exit or self._should_end(self._hub.pages)
        return await super().on_tick(counter)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams, then as always."""
        self._hub.close()
        await asyncio.sleep(0)
        await super().shutdown(sockets)
