import io

import pytest
from rich.table import Table

from touchdown.core.terminal import SafeConsole, make_console, printable, printable_line

HOSTILE = "a\x1b]0;b\x07\x9b31m\x7f\u202ec\udcff"


def test_what_controls_a_terminal_becomes_a_visible_sign():
    assert printable(HOSTILE) == "a␛]0;b␇�31m␡�c�"
    assert printable("Ünïcode ✓\tand\nlines") == "Ünïcode ✓\tand\nlines"


@pytest.mark.parametrize("end", ["\n", "\r\n", "\x85", "\u2028", "\x0c"])
def test_a_line_stays_one_line(end):
    assert printable_line(f"one{end}two") == "one two"


def test_a_console_prints_markup_and_hostile_names_as_text():
    file = io.StringIO()
    console = SafeConsole(file=file, force_terminal=True, color_system=None, width=80)
    table = Table("name")
    table.add_row(f"[red]{HOSTILE}[/]")
    console.print(table)
    console.print("[bold]x[/] 12 /tmp/3", ":smile:", HOSTILE)
    shown = file.getvalue()
    assert "\x1b]" not in shown
    assert "[red]a␛]0;b␇�31m␡�c�[/]" in shown.splitlines()[3]
    assert "[bold]x[/] 12 /tmp/3 :smile:" in shown
    shown.encode()  # no lone surrogate is left


def test_output_to_a_file_is_as_wide_as_the_user_says(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert make_console(on_terminal=False).width == 120
    monkeypatch.setenv("COLUMNS", "60")
    assert make_console(on_terminal=False).width == 60
