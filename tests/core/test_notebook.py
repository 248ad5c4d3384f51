import base64
import sys
from types import SimpleNamespace

import pytest
from rich.table import Table
from rich.text import Text

from touchdown.core import notebook


class FakeKernel:
    """What of IPython the code uses: it keeps what a page would show, by display."""

    def __init__(self) -> None:
        self.shown: list[str] = []
        self.drawings = 0
        self.display = SimpleNamespace(display=self._display)

    def get_ipython(self):
        return SimpleNamespace(kernel=object())

    def _display(self, bundle, *, raw, display_id):
        assert raw
        assert display_id
        place = len(self.shown)
        self.shown.append(bundle["text/plain"])

        def update(bundle, *, raw):
            assert raw
            self.drawings += 1
            self.shown[place] = bundle["text/plain"]

        return SimpleNamespace(update=update)


@pytest.fixture
def kernel(monkeypatch) -> FakeKernel:
    fake = FakeKernel()
    monkeypatch.setitem(sys.modules, "IPython", fake)
    return fake


def test_a_test_runs_in_no_notebook_and_a_kernel_is_one(monkeypatch):
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    assert not notebook.in_notebook()
    monkeypatch.setitem(sys.modules, "IPython", FakeKernel())
    assert notebook.in_notebook()


def test_ipython_on_a_terminal_is_no_notebook(monkeypatch):
    shell = SimpleNamespace(get_ipython=object)
    monkeypatch.setitem(sys.modules, "IPython", shell)
    assert not notebook.in_notebook()


def test_a_live_view_is_one_output_however_often_it_is_updated(kernel):
    live = notebook.Live(refresh_per_second=1e9)
    live.start()
    for step in range(100):
        live.update(Text(f"step {step}"))
    live.stop()
    assert kernel.shown == ["step 99\n"]


def test_updates_that_come_too_fast_are_left_out_but_for_the_last(kernel):
    live = notebook.Live(refresh_per_second=0.001)
    live.start()
    for step in range(100):
        live.update(Text(f"step {step}"))
    assert kernel.shown == ["step 0\n"]
    live.stop()
    assert kernel.shown == ["step 99\n"]
    assert kernel.drawings == 2
    assert not live.is_started


def test_a_transient_view_leaves_nothing(kernel):
    live = notebook.Live(refresh_per_second=1e9, transient=True)
    live.start()
    live.update(Text("working"))
    assert kernel.shown == ["working\n"]
    live.stop()
    assert kernel.shown == [""]


def test_a_name_that_looks_like_markup_is_shown_as_it_is(kernel):
    console = notebook.make_console()
    with console.capture() as printed:
        console.print("run [/x]")
    assert printed.get() == "run [/x]\n"
    live = notebook.Live(refresh_per_second=1e9)
    live.start()
    live.update("run [/x] :smile:")
    assert kernel.shown == ["run [/x] :smile:\n"]
    live.update(Table("[bold]x[/y]", "\x1b]0;b\x07"))
    assert "[bold]x[/y]" in kernel.shown[0]
    assert "\x1b" not in kernel.shown[0]


def test_facts_from_a_file_cannot_add_markup():
    evil = "<script>alert(1)</script>&"
    shown = notebook.facts_html(evil, evil, [(evil, evil)])
    assert "<script" not in shown
    assert shown.count("&lt;script&gt;alert(1)&lt;/script&gt;&amp;") == 4


def test_a_picture_is_inside_the_page_and_its_description_stays_an_attribute():
    data = b"\x89PNG"
    shown = notebook.picture_html(data, "png", '"><script>', width=10)
    assert f"data:image/png;base64,{base64.b64encode(data).decode()}" in shown
    assert 'alt="&quot;&gt;&lt;script&gt;"' in shown
    assert "&lt;b&gt;" in notebook.figure_html(shown, "<b>")


def test_a_text_is_one_line_whatever_it_holds():
    assert notebook.plain("ace-0 γ") == "ace-0 γ"
    assert notebook.plain("a\nb\x1b[31m\u202e") == "a\\nb\\x1b[31m\\u202e"


def test_a_value_that_nothing_draws_is_left_to_its_repr():
    assert notebook.html_of(object()) is None
