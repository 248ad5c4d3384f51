"""Opens a page in the user's browser without showing its address to other users."""

import contextlib
import os
import sys
import tempfile
import webbrowser
from collections.abc import Generator
from html import escape
from pathlib import Path

_LEADS_ON = """<!doctype html>
<meta charset="utf-8">
<title>touchdown</title>
<meta http-equiv="refresh" content="0; url={address}">
<a href="{address}">Open the page</a>
"""


@contextlib.contextmanager
def open_page(address: str | None) -> Generator[None]:
    """Open a page in a browser, if there is a display, while the block runs.

    The address may contain a secret, and all users of a machine see the words of a command. So the
    browser is given a file that only this user can read, which leads on to the page.

    Args:
        address: of the page; None opens nothing.
    """
    if address is None or not has_display():
        yield
        return
    with tempfile.TemporaryDirectory(prefix="touchdown-") as folder:
        path = Path(folder) / "open.html"
        path.write_text(_LEADS_ON.format(address=escape(address)), "utf-8")
        open_file(path)
        yield


def open_file(path: Path) -> None:
    """Open a file in a browser, if there is a display."""
    if has_display():
        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(path.absolute().as_uri())


def has_display() -> bool:
    """Whether a browser would be a window, and not a program in the terminal."""
    if sys.platform != "linux":
        return True
    return "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
