"""What a terminal shows: text from anywhere, without the characters that control it."""

import os
import re
from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from touchdown.core import processes

_PIPE_WIDTH = 120  # characters; output to a file may have longer lines than a terminal
_NOT_PRINTABLE = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # control characters but tabs and line feeds
    "\u200e\u200f\u202a-\u202e\u2066-\u2069"  # what changes the direction of text
    "\u2028\u2029\ud800-\udfff\ufffe\uffff]"  # other line ends, and what is no text
)


def printable(text: str) -> str:
    """Text with a visible sign for each character that would control the terminal.

    Escape sequences, a changed direction of text, and bytes of file names that are no text cannot
    reach a terminal, a file of UTF-8 or a figure this way.
    """
    return _NOT_PRINTABLE.sub(_sign, text)


def printable_line(text: str) -> str:
    """The same on one line."""
    return printable(" ".join(text.splitlines()))


def _sign(found: re.Match[str]) -> str:
    code = ord(found[0])
    if code < 0x20:
        return chr(0x2400 + code)  # Unicode has a picture of each of these
    return "\u2421" if code == 0x7F else "\ufffd"


class SafeConsole(Console):
    """A console that prints every text as it is: without markup, and without control characters.

    Args:
        settings: those of rich's `Console`.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(markup=False, emoji=False, highlight=False, **settings)

    def render_str(self, text: str, **settings: Any) -> Text:
        """A text to print, made printable before its width is measured."""
        return super().render_str(printable(text), **settings)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """The segments of a renderable, as rich makes them, with printable texts."""
        for segment in super().render(renderable, options):
            if segment.control is None and _NOT_PRINTABLE.search(segment.text):
                yield Segment(printable(segment.text), segment.style)
            else:
                yield segment

    def on_broken_pipe(self) -> None:
        """Print nothing further: the reader of a pipe, such as `head`, may leave before the end.

        The work goes on, because a run or a study is of use without its output; rich would end the
        process.
        """
        self.quiet = True
        processes.silence(self.file)


def make_console(*, on_terminal: bool, stderr: bool = False, quiet: bool = False) -> SafeConsole:
    """A console on standard output, or on standard error.

    Args:
        on_terminal: whether a person sees it; otherwise lines may be longer.
        stderr: whether to print on standard error.
        quiet: whether to print nothing.
    """
    width = None if on_terminal or "COLUMNS" in os.environ else _PIPE_WIDTH
    return SafeConsole(width=width, stderr=stderr, quiet=quiet)
