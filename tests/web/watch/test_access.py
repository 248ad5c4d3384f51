import base64
import hashlib

import pytest
from starlette.requests import Request

from touchdown.web.watch.access import is_local, new_token, policy_for


def request(*headers: tuple[str, str]) -> Request:
    raw = [(name.encode(), value.encode()) for name, value in headers]
    return Request({"type": "http", "headers": raw})


@pytest.mark.parametrize(
    "headers",
    [
        [("host", "127.0.0.1:8000")],
        [("host", "localhost:8000")],
        [("host", "localhost")],
        [("host", "127.0.0.1:8000"), ("origin", "http://127.0.0.1:8000")],
    ],
)
def test_this_machine_is_answered(headers):
    assert is_local(request(*headers))


@pytest.mark.parametrize(
    "headers",
    [
        [],
        [("host", "example.com")],  # a name that was made to lead here
        [("host", "example.com:8000")],
        [("host", "127.0.0.1.example.com")],
        [("host", "user@example.com")],
        [("host", "user@127.0.0.1")],
        [("host", "127.0.0.1/path")],
        [("host", "localhost:8000#x")],
        [("host", "[::1")],
        [("host", "127.0.0.1"), ("host", "127.0.0.1")],
        [("host", "127.0.0.1:8000"), ("origin", "http://example.com")],
        [("host", "127.0.0.1:8000"), ("origin", "null")],
        [("host", "127.0.0.1:8000"), ("origin", "http://127.0.0.1:8001")],
        [("host", "127.0.0.1:8000"), ("origin", "https://127.0.0.1:8000")],
        [("host", "127.0.0.1:8000"), ("origin", "http://localhost:8000")],
    ],
)
def test_other_names_and_origins_are_refused(headers):
    assert not is_local(request(*headers))


def test_tokens_are_long_and_never_the_same():
    tokens = {new_token() for _ in range(100)}
    assert len(tokens) == 100
    assert min(map(len, tokens)) >= 32


def test_only_the_scripts_of_a_page_may_run():
    script = "start();\n"
    html = f'<script type="application/json">{{}}</script><script type="module">{script}</script>'
    allowed = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = policy_for(html)
    assert f"script-src 'self' 'wasm-unsafe-eval' 'sha256-{allowed}';" in policy
    assert policy.count("sha256-") == 1
    assert policy.startswith("default-src 'none';")
    assert "connect-src 'self'" in policy
