"""Text from anywhere in Markdown and in its YAML header, so that a reader sees it as it is."""

import json
import os
import re
from pathlib import Path
from urllib.parse import quote

from touchdown.core.terminal import printable, printable_line

# characters that would begin a tag, an entity, a span, a formula, a cell or an attribute list
_SPECIAL = re.compile(
    r"[\\`*|~${]"
    r"|<(?![\s=]|$)"
    r"|&(?=[#A-Za-z])"
    r"|(?<![^\W_])_|_(?![^\W_])"  # inside a word it has no meaning
    r"|\](?=[(\[])"
)
# what makes a line a heading, a quotation, a rule, a definition or an item of a list
_FIRST = re.compile(r"[#>=\[:]|[+-](?=[\s-]|$)")
_NUMBERED = re.compile(r"(\d{1,9})([.)])(?=\s|$)")


def text(value: str) -> str:
    """A text as Markdown that shows it: one line without tags, links, formulas and cells.

    Special characters become entities rather than get a backslash, since every dialect knows
    those, even in the cell of a table.
    """
    line = _SPECIAL.sub(_entity, _one_line(value))
    numbered = _NUMBERED.match(line)
    if numbered:
        return f"{numbered[1]}{_entity_of(numbered[2])}{line[numbered.end() :]}"
    first = _FIRST.match(line)
    return f"{_entity_of(line[0])}{line[1:]}" if first else line


def code(value: str) -> str:
    """A text as a span of code, on one line."""
    line = _one_line(value)
    fence = _fence(line, 1)
    room = " " if line.startswith("`") or line.endswith("`") else ""
    return f"{fence}{room}{line}{room}{fence}"


def block(language: str, value: str) -> str:
    """A text as a block of code.

    Args:
        language: the language, for its colours.
        value: the code.
    """
    shown = printable(value)
    fence = _fence(shown, 3)
    return f"{fence}{language}\n{shown}\n{fence}"


def image(alt: str, path: Path) -> str:
    """A picture.

    Args:
        alt: alternative text.
        path: the file, relative to the text's folder.
    """
    shown = text(alt).replace("[", _entity_of("[")).replace("]", _entity_of("]"))
    return f"![{shown}]({quote(os.fsencode(path.as_posix()))})"


def yaml_text(value: str) -> str:
    """A text as a YAML value in quotes; JSON is a subset of YAML."""
    return json.dumps(printable(value), ensure_ascii=False)


def _one_line(value: str) -> str:
    return " ".join(printable_line(value).split())


def _fence(value: str, least: int) -> str:
    """More backticks than the text has in a row."""
    longest = max(map(len, re.findall("`+", value)), default=0)
    return "`" * max(least, longest + 1)


def _entity(found: re.Match[str]) -> str:
    return _entity_of(found[0])


def _entity_of(character: str) -> str:
    return f"&#{ord(character)};"
