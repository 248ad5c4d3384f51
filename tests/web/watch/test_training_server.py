"""A training that is watched, without a browser."""

import os
import re
import shutil
import socket
import subprocess
import sys
import time
from contextlib import closing
from http.client import HTTPConnection

import pytest

import touchdown
from touchdown.core.errors import UserError
from touchdown.runs.folder import RunFolder
from touchdown.web.watch import training_server
from touchdown.web.watch.training_server import watched


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
    assert time.monotonic() > training_has_ended + training_server._CLOSED_SECONDS


def test_a_page_is_answered_after_the_end_of_training(run):
    with watched(run) as address:
        port, path = parts_of(address)
        page = HTTPConnection("127.0.0.1", port, timeout=20)
        page.request("GET", path)
        answer = page.getresponse()
    time.sleep(training_server._CLOSED_SECONDS + 1)
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


@pytest.mark.parametrize("line", ["", "Warning: x", "[]", '{"address": 1}', "\\0377"])
def test_an_answer_that_is_not_the_servers_counts_as_none(run, tmp_path, monkeypatch, line):
    program = tmp_path / "python"
    program.write_text(f"#!/bin/sh\nprintf '{line}\\n'\n")
    program.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(program))
    with pytest.raises(UserError, match="no answer"), watched(run):
        pytest.fail("it yields no address")


def train_watched(runs_dir):
    """A run of one episode, named `x`, that is watched and shows no progress."""
    settings = {"episodes": 1, "validation_episodes": 1, "final_validation_episodes": 1}
    return touchdown.train(
        "pilot",
        name="x",
        runs_dir=runs_dir,
        watch=True,
        progress=False,
        hidden_sizes=(8,),
        test_episodes=0,
        **settings,
    )


def test_training_goes_on_without_a_server(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "nothing"))
    with pytest.warns(UserWarning, match="the server did not start: .*; training goes on without"):
        trained = train_watched(tmp_path)
    assert trained.status == "finished"


def test_its_address_is_printed_even_if_progress_is_not_shown(tmp_path, capsys):
    train_watched(tmp_path)
    assert capsys.readouterr().out.startswith("watch: http://127.0.0.1:")
    # a finished run has no training to watch
    touchdown.resume("x", runs_dir=tmp_path, watch=True, progress=False)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("browser", [True, False])
def test_the_page_opens_in_a_browser_only_if_asked(run, tmp_path, monkeypatch, browser):
    opened = tmp_path / "opened"
    program = tmp_path / "browser"
    program.write_text(f"#!/bin/sh\ntouch {opened}\n")
    program.chmod(0o755)
    monkeypatch.setenv("BROWSER", str(program))
    monkeypatch.setenv("DISPLAY", ":0")
    with watched(run, browser=browser):
        until = time.monotonic() + (20 if browser else 2)
        while not opened.exists() and time.monotonic() < until:
            time.sleep(0.1)
        assert opened.exists() == browser


def test_a_list_of_runs_that_is_asked_for_keeps_the_server(run):
    with watched(run) as address:
        port, path = parts_of(address)
        start = path.partition("events")[0]
    for _ in range(3):
        time.sleep(0.7 * training_server._CLOSED_SECONDS)
        with closing(HTTPConnection("127.0.0.1", port, timeout=20)) as page:
            page.request("GET", f"{start}runs")
            with page.getresponse() as answer:
                assert answer.status == 200


def test_a_server_that_does_not_start_is_one_line(run, monkeypatch):
    program = shutil.which("false")
    assert program is not None
    monkeypatch.setattr(sys, "executable", program)
    with (
        pytest.raises(UserError, match="watch: the server did not start: no answer"),
        watched(run),
    ):
        pytest.fail("it yields no address")
