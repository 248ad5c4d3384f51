"""A training that is watched, without a browser."""

import os
import re
import socket
import subprocess
import sys
import time
from contextlib import closing
from http.client import HTTPConnection

import pytest

from touchdown.core.errors import UserError
from touchdown.runs.folder import RunFolder
from touchdown.web.watch import beside
from touchdown.web.watch.beside import watched


@pytest.fixture(autouse=True)
def no_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


def parts_of(address):
    """The port, and the path of the stream of messages."""
    port, path = re.fullmatch(r"http://127\.0\.0\.1:(\d+)(/.*)", address).groups()
    return int(port), path.replace("?", "events?")


def test_the_server_stays_while_a_page_is_open_and_ends_with_it(run):
    with watched(run) as address:
        port, path = parts_of(address)
        with closing(HTTPConnection("127.0.0.1", port, timeout=20)) as page:
            page.request("GET", path)
            with page.getresponse() as answer:
                assert answer.status == 200
                assert b"watched" in answer.readline()
                training_has_ended = time.monotonic()
    while is_open(port):
        assert time.monotonic() < training_has_ended + 60
        time.sleep(0.1)
    assert time.monotonic() > training_has_ended + beside._CLOSED_SECONDS


def test_a_page_is_answered_after_the_end_of_training(run):
    with watched(run) as address:
        port, path = parts_of(address)
        page = HTTPConnection("127.0.0.1", port, timeout=20)
        page.request("GET", path)
        answer = page.getresponse()
    time.sleep(beside._CLOSED_SECONDS + 1)
    with closing(page), answer, closing(HTTPConnection("127.0.0.1", port, timeout=20)) as other:
        other.request("GET", path.partition("events")[0])
        with other.getresponse() as late:
            assert late.status == 200


def is_open(port):
    with socket.socket() as trying:
        return trying.connect_ex(("127.0.0.1", port)) == 0


def test_training_goes_on_without_a_page_and_prints_its_address(tmp_path):
    ended = subprocess.run(
        [
            *(sys.executable, "-m", "touchdown", "train", "pilot", "--watch", "--name=x"),
            *("--episodes=2", "--hidden-sizes=8", "--test-episodes=0"),
            *("--validation-episodes=1", "--final-validation-episodes=1"),
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )
    assert ended.returncode == 0, ended.stderr
    assert re.match(r"watch: http://127\.0\.0\.1:\d+/[\w-]{32}/\?run=[0-9a-f]{16}\n", ended.stdout)
    assert RunFolder(tmp_path / "runs" / "x").episodes.read_text().count("\n") == 2


def test_a_server_that_does_not_start_is_one_line(run, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with (
        pytest.raises(UserError, match="watch: the server did not start: no answer"),
        watched(run),
    ):
        pytest.fail("it yields no address")
