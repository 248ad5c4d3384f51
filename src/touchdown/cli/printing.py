"""Prints lines, paths and JSON without wrapping and without interpreting markup."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from touchdown.core import processes
from touchdown.core.terminal import printable

if TYPE_CHECKING:
    from rich.console import Console


def print_line(console: "Console", line: object) -> None:
    """Print one line that scripts may read: unwrapped, without markup."""
    console.print(str(line), soft_wrap=True)


def print_indented(console: "Console", lines: Iterable[Path | str]) -> None:
    """Print paths or details, indented under the previous output."""
    for line in lines:
        console.print(f"  {line}", soft_wrap=True)


def print_json(value: object) -> None:
    """Print a value as JSON on standard output."""
    text = json.dumps(value, indent=2, ensure_ascii=False)
    if printable(text) != text:  # what a terminal must not get is escaped
        text = json.dumps(value, indent=2)
    processes.print_out(f"{text}\n")
