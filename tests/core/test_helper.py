import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing

import pytest

from touchdown.core.errors import Interrupted
from touchdown.core.helper import Helper, HelperError, second_core

_FUNCTIONS = """
import os

def double(*, number, tick):
    print("a library says something")
    for _ in range(number):
        tick()
    return 2 * number

def write(*, path, tick):
    from pathlib import Path
    from time import sleep
    from touchdown.core import files
    def slowly(temporary):
        temporary.write_text("half")
        tick()
        sleep(60)
    files.write_through(Path(path), slowly)

def fail(*, tick):
    raise ValueError("no\\nway")

def end(*, tick):
    os._exit(3)
"""


@pytest.fixture
def helper(monkeypatch, tmp_path) -> Iterator[Helper]:
    (tmp_path / "functions.py").write_text(_FUNCTIONS)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with closing(Helper()) as helper:
        yield helper


def test_calls_are_answered_in_order_and_earlier_answers_are_dropped(helper):
    ticks: list[None] = []
    calls = [helper.start("functions:double", number=number) for number in (3, 4, 5)]
    assert helper.result(calls[1], lambda: ticks.append(None)) == 8
    assert len(ticks) == 3 + 4
    assert helper.result(calls[2]) == 10


def test_an_exception_is_told_and_the_next_call_is_answered(helper):
    failed, doubled = helper.start("functions:fail"), helper.start("functions:double", number=1)
    with pytest.raises(HelperError, match="no way"):
        helper.result(failed)
    assert helper.has_done(doubled)
    assert not helper.has_done(helper.start("nowhere:nothing"))


def test_a_helper_that_has_ended_is_an_error_only_for_who_waits(helper):
    helper.result(helper.start("functions:double", number=0))
    ended, after = helper.start("functions:end"), helper.start("functions:double", number=1)
    for call in (ended, after, helper.start("functions:double", number=1)):
        with pytest.raises(HelperError):
            helper.result(call)
    helper.close()
    with pytest.raises(HelperError):
        helper.result(helper.start("functions:double", number=1))


def test_a_helper_that_is_closed_leaves_nothing_half_written(helper, tmp_path):
    def stop() -> None:
        raise Interrupted

    folder = tmp_path / "out"
    folder.mkdir()
    with pytest.raises(Interrupted):
        helper.result(helper.start("functions:write", path=str(folder / "film.mp4")), stop)
    assert len(list(folder.iterdir())) == 1
    helper.close()
    assert not list(folder.iterdir())


def test_a_helper_ends_with_the_process_that_started_it():
    program = (
        "import time\n"
        "from touchdown.core.helper import Helper\n"
        "helper = Helper()\n"
        "print(helper._process.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        os.kill(parent.pid, signal.SIGKILL)
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    pytest.fail("the helper is still there")


def test_a_process_that_may_use_one_core_has_no_helper(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert second_core() is None
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    made = second_core()
    assert made is not None
    made.close()
