"""How every command must end, whatever it is given."""

import io
import time
import warnings
from contextlib import redirect_stderr, redirect_stdout

from touchdown.cli import app

MOST_SECONDS = 30.0  # a case takes milliseconds, but may import a library or wait for the machine


def ends_in_one_line(argv: list[str]) -> None:
    """Run a command here, and check its exit code and what it says."""
    out, err = io.StringIO(), io.StringIO()
    code: object = 0
    began = time.monotonic()
    with redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings():
        try:
            app.main(argv)
        except SystemExit as stop:
            code = stop.code
    assert time.monotonic() - began < MOST_SECONDS
    said = err.getvalue()
    assert code in (0, 2, 130)
    assert len(said.splitlines()) == (0 if code == 0 else 1), said
    assert code == 0 or said.startswith("touchdown: ")
    for shown in (said, out.getvalue()):
        shown.encode()  # no byte that is no text
        assert "\x1b" not in shown
        assert "Traceback" not in shown
