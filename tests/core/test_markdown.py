from pathlib import Path

import pytest
import yaml
from markdown import markdown as to_html
from markdown_it import MarkdownIt

from shown import Shown
from touchdown.core import markdown
from touchdown.core.terminal import printable, printable_line

HARMLESS = (
    "learning_rate 0.1, a & b, 2 < 3 > 1 = 1",
    "target-dqn 171 [108, 223]: difference -26 [-41, -11], better in 46% of pairs; p < 0.001",
    "3.14",
    "-26",
)
HOSTILE = (
    "<script>alert(1)</script>", "<!-- hidden -->", "<a@b.c>", "&lt;b&gt; &#35;",
    "[x](javascript:alert(1))", "![x](https://e.org/x.png)", "[a][b]", "[b]: https://e.org",
    "[^1]: a note", "[ ] done", "[TOC]", "*[HTML]: a word",
    "a | b", "||", "`code`", "a``b`c", "```", "~~~", "~~gone~~",
    "# title", "1. one", "12) twelve", "- x", "+ x", "* x", "> x", "---", "===", "***", ": x",
    "**bold**", "__init__", "_x_", "a _b_", "$x_{$", "\\*a\\*", "x\\", "{: onclick=x }",
    "a\n\n# b\n\n```\n", "    indented", "\x1b[31mred\x07", "bytes that are no text: \udcff",
)  # fmt: skip
PLACES = {
    "{}": ["p"],
    "## {}": ["h2"],
    "- {}": ["ul", "li"],
    "| a |\n| --- |\n| {} |": ["table", "thead", "tr", "th", "tbody", "tr", "td"],
}
_EXTENSIONS = ("tables", "fenced_code", "attr_list", "footnotes", "toc", "abbr", "def_list")
_GITHUB = MarkdownIt("commonmark").enable(["table", "strikethrough"])
DIALECTS = (lambda text: to_html(text, extensions=_EXTENSIONS), _GITHUB.render)


def line(value):
    return " ".join(printable_line(value).split())


@pytest.mark.parametrize("render", DIALECTS)
@pytest.mark.parametrize("value", [*HARMLESS, *HOSTILE])
def test_text_is_shown_as_it_is_wherever_it_stands(value, render):
    for place, tags in PLACES.items():
        shown = Shown(render(place.format(markdown.text(value))))
        assert shown.tags == tags
        assert line(value) in shown.text.splitlines()
    shown = Shown(render(markdown.code(value)))
    assert (shown.tags, shown.text.strip()) == (["p", "code"], line(value))
    assert Shown(render(markdown.block("toml", value))).tags == ["pre", "code"]
    shown = Shown(render(markdown.image(value, Path("a b") / "x(1).png")))
    assert shown.tags == ["p", "img"]
    assert shown.values("alt") == [line(value)]
    assert shown.values("src")[0].startswith("a%20b/x")


@pytest.mark.parametrize("value", HARMLESS)
def test_text_without_a_meaning_in_markdown_stays_readable_in_the_file(value):
    assert markdown.text(value) == value


@pytest.mark.parametrize("value", [*HARMLESS, *HOSTILE, "a: b # c", "\x85\u2028\ufffe\U0001f600"])
def test_a_yaml_header_has_the_printable_text(value):
    header = yaml.safe_load(f"name: {markdown.yaml_text(value)}\nnext: 1")
    assert header.pop("name") == printable(value)
    assert header == {"next": 1}
