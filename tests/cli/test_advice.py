"""Every command that our documentation, help texts and messages advise is one that we accept."""

import ast
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from touchdown.cli import parse
from touchdown.core.errors import UserError
from touchdown.runs.folder import RunFolder

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES.remove(ROOT / "docs" / "ladder" / "adding.md")  # adds a preset and a flag of its own
PAGES += [ROOT / "src/touchdown/policies/shipped/README.md"]
SOURCES = sorted((ROOT / "src").rglob("*.py"))
FIRST = "|".join(parse.VERBS)
COMMAND = re.compile(rf"(?:^|[\s`(]|\.venv/bin/)touchdown ((?:{FIRST}|VERB|--\w+)\b[^`\n]*)")
STAND_INS = {"VERB": "train", "PRESET": "pilot", "NAME": "paper", "RUN": "pilot-0"}


def commands_in(text: str) -> Iterator[str]:
    """Commands in code spans, and those that begin a line of a block of code."""
    in_block = False
    for line in text.splitlines():
        if line.strip().startswith("```"):
            in_block = not in_block
        spans = [line.strip()] if in_block else re.findall(r"`[^`]*`", line)
        for span in spans:
            for command in COMMAND.findall(span):
                yield from re.split(r" (?:&&|>|\|) ", command)[:1]


def texts_in(source: str) -> Iterator[str]:
    """The strings of a program; 1 stands for what an f-string inserts."""
    nodes = list(ast.walk(ast.parse(source)))
    parts = {part for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in nodes:
        if node in parts:
            continue
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value
        elif isinstance(node, ast.JoinedStr):
            yield "".join(
                str(part.value) if isinstance(part, ast.Constant) else "1" for part in node.values
            )


def refusal_of(command: str) -> str:
    command = re.sub(r"\$\w+|<[^>]*>", "1", command).replace("--rule 1", "--rule signed")
    words = shlex.split(command, comments=True)
    if " ".join(words) in (*parse.VERBS, *parse.COMMANDS):  # it only names the verb
        return ""
    if words[0] in ("train", "presets") and words[1] in ("1", "NAME"):
        words[1] = "pilot"
    words = [STAND_INS.get(word, word) for word in words if word not in ("...", "…")]
    try:
        parse.parse(words)
    except UserError as error:
        # the file of an example
        return "" if "cannot be read: No such file" in str(error) else str(error)
    except SystemExit:
        return ""  # help was printed
    return ""


@pytest.mark.usefixtures("capsys")  # some print help
def test_every_command_of_the_documentation_is_accepted():
    found = {
        (page.name, line): refusal_of(line)
        for page in PAGES
        for line in commands_in(page.read_text("utf-8"))
    }
    assert len(found) > 50
    assert {line: why for line, why in found.items() if why} == {}


@pytest.mark.usefixtures("capsys")
def test_every_command_in_a_message_is_accepted():
    found: dict[str, str] = {}
    for source in SOURCES:
        for text in texts_in(source.read_text("utf-8")):
            for command in re.findall(rf"\btouchdown ((?:{FIRST}|VERB)\b[^`;:\n]*)", text):
                found[command] = refusal_of(command)
    assert len(found) > 10
    assert {line: why for line, why in found.items() if why} == {}


def test_a_command_about_a_run_is_quoted_and_says_where_the_run_is():
    folder = RunFolder(Path("my runs/it's mine"))
    program, *words = shlex.split(folder.resume_command("--trust"))
    verb = parse.parse(words)
    assert program == "touchdown"
    assert (verb.resume, verb.runs_dir, verb.trust) == ("it's mine", Path("my runs"), True)
    assert shlex.split(folder.restart_command())[1:] == [
        *("train", "--config", "my runs/it's mine/config.toml", "--runs-dir", "my runs")
    ]
    assert RunFolder(Path("runs/a")).resume_command() == "touchdown train --resume a"
