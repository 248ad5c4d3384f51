import os
import pty
import signal
import sys
import threading

import pytest

from touchdown.core import processes

STOPPING = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.mark.parametrize("number", STOPPING)
def test_a_signal_that_asks_to_stop_is_told_and_its_former_handler_comes_back(number):
    told = []
    before = signal.getsignal(number)
    with processes.stopping(told.append):
        os.kill(os.getpid(), number)
    assert told == [number]
    assert signal.getsignal(number) is before


@pytest.mark.parametrize("number", STOPPING)
def test_a_signal_stops_at_once_where_nothing_has_to_be_saved(number):
    with pytest.raises(KeyboardInterrupt), processes.stopping(processes.interrupt):
        os.kill(os.getpid(), number)


def test_what_nohup_ignores_is_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    told = []
    with processes.stopping(told.append):
        os.kill(os.getpid(), signal.SIGHUP)
    assert told == []
    assert signal.signal(signal.SIGHUP, before) is signal.SIG_IGN


def test_another_thread_catches_no_signals():
    before = signal.getsignal(signal.SIGTERM)
    seen = []

    def work() -> None:
        with processes.stopping(seen.append):
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


def test_a_closed_terminal_takes_no_more_output_but_does_not_stop_the_saving(monkeypatch):
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as terminal:
        monkeypatch.setattr(sys, "stdout", terminal)
        with processes.stopping(lambda _: None):
            os.close(ours)  # as when the window is closed
            os.kill(os.getpid(), signal.SIGHUP)
        print("saved", flush=True)  # noqa: T201 - without an OSError
