"""The addresses of the local server, all below its token."""

import asyncio
import json
from collections.abc import AsyncGenerator
from contextlib import aclosing, asynccontextmanager, suppress
from pathlib import PurePosixPath
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from touchdown.core.errors import UserError
from touchdown.core.terminal import printable_line
from touchdown.runs.folder import RunFolder
from touchdown.web import page
from touchdown.web.watch import flights, pages
from touchdown.web.watch.access import HEADERS, Guard, policy_for
from touchdown.web.watch.hub import MOST_RUNS, Hub
from touchdown.web.watch.run_index import RunIndex

_TYPES = {".js": "text/javascript"}


def make_app(index: RunIndex, hub: Hub, token: str) -> ASGIApp:
    """The server's application.

    Args:
        index: the runs that may be shown.
        hub: reads the runs that pages show.
        token: the secret at the beginning of each address.
    """

    def show(request: Request) -> Response:
        keys = _keys(request)
        found = [run for key in keys if (run := index.find(key))]
        html = pages.runs_page(index) if not keys else pages.live_page(keys, found)
        security = {"Content-Security-Policy": policy_for(html)}
        return Response(html, media_type="text/html", headers=HEADERS | security)

    def listing(_request: Request) -> Response:
        return JSONResponse(index.listing(), headers=HEADERS)

    async def events(request: Request) -> Response:
        stream = _stream(hub, _keys(request))
        return StreamingResponse(stream, media_type="text/event-stream", headers=HEADERS)

    def policy(request: Request) -> Response:
        data = flights.read_policy(folder_of(request), str(request.path_params["env_steps"]))
        return Response(data, media_type="application/octet-stream", headers=HEADERS)

    def episode(request: Request) -> Response:
        row = flights.read_episode(folder_of(request), str(request.path_params["number"]))
        return JSONResponse(row, headers=HEADERS)

    def folder_of(request: Request) -> RunFolder:
        run = index.find(str(request.path_params["key"]))
        if run is None:
            raise UserError("there is no such run")
        return run.folder

    @asynccontextmanager
    async def lifespan(_app: Starlette) -> AsyncGenerator[None]:
        polling = asyncio.create_task(hub.poll())
        yield
        polling.cancel()
        with suppress(asyncio.CancelledError):
            await polling

    async def noted(scope: Scope, receive: Receive, send: Send) -> None:
        hub.note_request()
        await app(scope, receive, send)

    app = Starlette(
        routes=[
            Route("/", show),
            Route("/runs", listing),
            Route("/events", events),
            Route("/run/{key}/policy/{env_steps}", policy),
            Route("/run/{key}/episode/{number}", episode),
            Route("/static/{name:path}", _static),
        ],
        lifespan=lifespan,
        exception_handlers={
            UserError: _not_found,
            HTTPException: _http_error,
            Exception: _http_error,
        },
    )
    app.router.redirect_slashes = False  # it would leave out the token
    return Guard(noted, token)


def _static(request: Request) -> Response:
    name = str(request.path_params["name"])
    if name == pages.CHARTS:
        data = pages.charts_script()
    elif name in page.module_names():
        data = page.static_file(name)
    else:
        raise UserError("there is no such file")
    return Response(data, media_type=_TYPES[PurePosixPath(name).suffix], headers=HEADERS)


async def _stream(hub: Hub, keys: list[str]) -> AsyncGenerator[str]:
    async with aclosing(hub.follow(keys)) as messages:
        async for message in messages:
            yield ": \n\n" if message is None else f"data: {_compact(message)}\n\n"


def _compact(value: dict[str, Any]) -> str:
    return json.dumps(value, separators=(",", ":"))


def _keys(request: Request) -> list[str]:
    return list(dict.fromkeys(request.query_params.getlist("run")))[:MOST_RUNS]


def _not_found(_request: Request, error: Exception) -> Response:
    return PlainTextResponse(printable_line(str(error)), 404, HEADERS)


def _http_error(_request: Request, error: Exception) -> Response:
    if isinstance(error, HTTPException):
        return PlainTextResponse("there is no such page", error.status_code, HEADERS)
    return PlainTextResponse("the server cannot answer this", 500, HEADERS)
