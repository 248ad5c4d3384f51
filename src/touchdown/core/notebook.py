"""Output in a notebook: a console, live views, and values as HTML."""

import base64
import html
import io
import sys
import time
from collections.abc import Iterable
from functools import singledispatch
from typing import Any

from rich.console import RenderableType
from rich.terminal_theme import TerminalTheme
from rich.theme import Theme

from touchdown.core.terminal import SafeConsole

_WIDTH = 100  # characters per line
_GREY = (128, 128, 128)
# A notebook may be light or dark: unstyled text keeps the page's colour, dim text is grey, and bars
# have colours that are visible on both.
_COLOURS = TerminalTheme(_GREY, _GREY, [_GREY] * 8)
_STYLES = Theme(
    {
        "bar.back": "#757575",
        "bar.complete": "#1e88e5",
        "bar.finished": "#43a047",
        "bar.pulse": "#1e88e5",
        "progress.download": "none",
        "progress.percentage": "none",
        "progress.remaining": "dim",
    }
)
_FRAME = (
    '<pre style="white-space:pre;overflow-x:auto;line-height:normal;margin:0;'
    "font-family:Menlo,'DejaVu Sans Mono',consolas,monospace\">{code}</pre>"
)


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")  # loaded in every kernel, and by nothing else
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None


def make_console() -> SafeConsole:
    """A console that prints to the output of the running cell."""
    return SafeConsole(force_jupyter=True, width=_WIDTH)


class Live:
    """A view in a cell's output that every update replaces.

    rich's `Live` needs ipywidgets here, whose output is not saved with the notebook. This view
    replaces its own output, so that a saved notebook contains only the last state.

    Args:
        refresh_per_second: largest rate of drawn updates; the last update is always drawn.
        transient: whether to remove the view at the end.
    """

    def __init__(self, *, refresh_per_second: float, transient: bool = False) -> None:
        self._seconds = 1 / refresh_per_second
        self._transient = transient
        self._handle: Any = None
        self._drawn = 0.0
        self._waiting: RenderableType | None = None

    @property
    def is_started(self) -> bool:
        """Whether it is in a cell's output."""
        return self._handle is not None

    def start(self) -> None:
        """Display the view in the running cell's output."""
        self._handle = sys.modules["IPython"].display.display(_blank(), raw=True, display_id=True)

    def update(self, renderable: RenderableType) -> None:
        """Replace the content."""
        self._waiting = renderable
        if self.is_started and time.monotonic() - self._drawn >= self._seconds:
            self._draw()

    def stop(self) -> None:
        """Draw the last update, or nothing if the view is transient."""
        if self._transient:
            self._handle.update(_blank(), raw=True)
        else:
            self._draw()
        self._handle = None

    def _draw(self) -> None:
        if self._waiting is not None:
            self._handle.update(_drawn(self._waiting), raw=True)
            self._waiting = None
            self._drawn = time.monotonic()


def _blank() -> dict[str, str]:
    return {"text/html": "", "text/plain": ""}


def _drawn(renderable: RenderableType) -> dict[str, str]:
    """Terminal output as HTML and as plain text."""
    page = SafeConsole(
        record=True,
        file=io.StringIO(),
        force_terminal=True,
        force_jupyter=False,
        color_system="truecolor",
        width=_WIDTH,
        theme=_STYLES,
    )
    page.print(renderable)
    return {
        "text/html": page.export_html(
            theme=_COLOURS, code_format=_FRAME, inline_styles=True, clear=False
        ),
        "text/plain": page.export_text(),
    }


@singledispatch
def html_of(value: object) -> str | None:  # noqa: ARG001 - the signature of the registered functions
    """A value as HTML.

    Higher-level packages register functions for their values' types. Without one this is None, and
    the notebook shows the value's repr.
    """
    return None


def plain(text: str) -> str:
    """Text from a file as one printable line; unprintable characters are escaped."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def facts_html(
    title: str, line: str, facts: Iterable[tuple[str, str]] = (), picture: str = ""
) -> str:
    """A title and a line above a table of facts, with a picture next to it if there is room.

    Args:
        title: text in bold; escaped.
        line: text after the title; escaped.
        facts: names and values; escaped.
        picture: HTML from `picture_html`.
    """
    rows = "".join(
        f'<tr><td style="text-align:left">{html.escape(name)}</td>'
        f'<td style="text-align:right;white-space:nowrap">{html.escape(value)}</td></tr>'
        for name, value in facts
    )
    table = f'<table style="margin:0">{rows}</table>' if rows else ""
    return (
        f"<div><div><strong>{html.escape(title)}</strong>: {html.escape(line)}</div>"
        '<div style="display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start;margin-top:.5em">'
        f"{table}{picture}</div></div>"
    )


def figure_html(picture: str, caption: str) -> str:
    """A picture with a caption below it.

    Args:
        picture: HTML from `picture_html`.
        caption: text; escaped.
    """
    text = f"<figcaption>{html.escape(caption)}</figcaption>"
    return f'<figure style="margin:0">{picture}{text}</figure>'


def picture_html(data: bytes, kind: str, description: str, *, width: int) -> str:
    """A picture embedded in the page.

    Args:
        data: the file's bytes.
        kind: image format, such as `png`.
        description: alternative text; escaped.
        width: width in pixels; smaller on a narrow page.
    """
    source = f"data:image/{kind};base64,{base64.b64encode(data).decode()}"
    return (
        f'<img src="{source}" alt="{html.escape(description)}" '
        f'style="width:{width}px;max-width:100%;height:auto;border-radius:4px">'
    )
