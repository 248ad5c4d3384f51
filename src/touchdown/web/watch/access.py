"""Who may talk to the server: pages that it served itself, from this machine, with its token."""

import base64
import hashlib
import hmac
import re
import secrets

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

_HOST = re.compile(r"(127\.0\.0\.1|localhost)(:[0-9]{1,5})?")
_SCRIPT = re.compile(r"<script([^>]*)>(.*?)</script>", re.DOTALL)
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""Of every response."""


def new_token() -> str:
    """A secret that nobody guesses, for a URL."""
    return secrets.token_urlsafe(24)


class Guard:
    """Lets through only requests that may be answered; the others get 403.

    A request must begin with the token. Its `Host` must be this machine, or a page elsewhere could
    have its own name lead here; its `Origin`, if it has one, must be this server.

    Args:
        app: answers the requests, whose paths then begin after the token.
        token: the secret.
    """

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app = app
        self._token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self._app(scope, receive, send)
            return
        token, slash, rest = str(scope["path"]).removeprefix("/").partition("/")
        if not (self._is_known(token) and is_local(Request(scope))):
            await _refused("forbidden\n", 403)(scope, receive, send)
        elif scope["method"] not in ("GET", "HEAD"):
            await _refused("only GET\n", 405)(scope, receive, send)
        elif not slash:  # the links of a page are relative to its folder
            query = f"?{Request(scope).url.query}".rstrip("?")
            headers = {**HEADERS, "Location": f"/{token}/{query}"}
            await Response(None, 307, headers)(scope, receive, send)
        else:
            inner = {**scope, "path": f"/{rest}", "raw_path": f"/{rest}".encode()}
            await self._app(inner, receive, send)

    def _is_known(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(errors="replace"), self._token.encode())


def is_local(request: Request) -> bool:
    """Whether a request names this machine, and comes from no page of another origin."""
    hosts = request.headers.getlist("host")
    origins = request.headers.getlist("origin")
    if len(hosts) != 1 or len(origins) > 1:
        return False
    named = _HOST.fullmatch(hosts[0]) is not None
    return named and all(origin == f"http://{hosts[0]}" for origin in origins)


def policy_for(page: str) -> str:
    """The content security policy of a page: only its own scripts run, only this server is asked.

    Args:
        page: its HTML, whose scripts are known by their hashes.
    """
    hashes = [
        f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
        for attributes, script in _SCRIPT.findall(page)
        if script and "application/json" not in attributes
    ]
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src 'self' 'wasm-unsafe-eval' {' '.join(hashes)}",
            "style-src 'unsafe-inline'",  # charts set the style of their parts
            "img-src data: blob:",
            "connect-src 'self'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        ]
    )


def _refused(text: str, code: int) -> Response:
    return PlainTextResponse(text, code, HEADERS)
