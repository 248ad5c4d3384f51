import io
import sys
from types import SimpleNamespace

import pytest
from rich.console import Console

from touchdown.core import notebook, progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def in_notebook(monkeypatch):
    monkeypatch.setattr(notebook, "in_notebook", lambda: True)


def test_a_script_without_a_terminal_is_silent_unless_asked(monkeypatch):
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    assert progress.console_for(None, None).quiet
    assert progress.console_for(progress=False, console=None).quiet
    assert not progress.console_for(progress=True, console=None).quiet


def test_a_terminal_and_a_notebook_show_progress_unless_told_not_to(monkeypatch):
    monkeypatch.setattr(sys, "stdout", Terminal())
    assert not progress.console_for(None, None).quiet
    assert progress.console_for(progress=False, console=None).quiet
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    monkeypatch.setattr(notebook, "in_notebook", lambda: True)
    assert progress.console_for(None, None).is_jupyter
    assert not progress.console_for(None, None).quiet
    assert progress.console_for(progress=False, console=None).quiet


def test_a_console_that_is_given_is_used_unless_progress_is_false():
    console = Console(file=io.StringIO())
    assert progress.console_for(None, console) is console
    assert progress.console_for(progress=True, console=console) is console
    assert progress.console_for(progress=False, console=console).quiet


def test_a_bar_is_drawn_on_a_terminal_and_leaves_nothing_in_a_file():
    for is_terminal in (True, False):
        file = io.StringIO()
        console = Console(file=file, force_terminal=is_terminal, force_jupyter=False, width=80)
        with progress.Counter(console, "flying", 2) as count:
            assert count.is_drawn is is_terminal
            count()
            count()
        assert ("flying" in file.getvalue()) is is_terminal


@pytest.mark.usefixtures("in_notebook")
def test_a_bar_in_a_notebook_is_drawn_over_and_taken_away(monkeypatch):
    outputs: list[str] = []
    handle = SimpleNamespace(update=lambda bundle, **_: outputs.append(bundle["text/plain"]))
    fake = SimpleNamespace(display=SimpleNamespace(display=lambda *_, **__: handle))
    monkeypatch.setitem(sys.modules, "IPython", fake)
    with progress.Counter(notebook.make_console(), "flying", 2) as count:
        count()
    assert "flying" in outputs[0]
    assert outputs[-1] == ""


@pytest.mark.usefixtures("in_notebook")
def test_a_silent_console_draws_nothing_in_a_notebook():
    with progress.Counter(Console(quiet=True, force_jupyter=True), "flying", 2) as count:
        assert not count.is_drawn
        count()


@pytest.mark.parametrize(("seconds", "said"), [(5.4, "0:05"), (61, "1:01"), (3_661, "1:01:01")])
def test_seconds_are_shown_as_a_clock(seconds, said):
    assert progress.clock(seconds) == said
