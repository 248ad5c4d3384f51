"""A page of the ladder says what its preset changes, and what its picture shows."""

import re
import tomllib
from pathlib import Path

import pytest

from touchdown.config import ladder

LADDER = Path(__file__).parents[2] / "docs" / "ladder"
PAGES = {
    **{rung: rung for rung in ladder.BUILDS_ON},
    "tabular-expected-sarsa": "tabular-sarsa",
    "rainbow-lite": "rainbow",
}
"""The page of each rung."""
PICTURE = r"^!\[(.*?)\]\(\.\./pictures/ladder/([a-z0-9-]+)\.png\)\n\n(.*?)\n\n"
BUILDS_ON = (
    r"^(?:Builds|`{}` builds) on: \[`([a-z0-9-]+)`\]\(([a-z0-9-]+)\.md\)\. Changes: (.*?)\n\n"
)


def text_of(page):
    return (LADDER / f"{page}.md").read_text("utf-8")


@pytest.mark.parametrize("rung", ladder.BUILDS_ON)
def test_a_page_says_what_its_rung_builds_on_and_changes(rung):
    text = text_of(PAGES[rung])
    found = re.findall(BUILDS_ON.format(rung), text, re.DOTALL | re.MULTILINE)
    assert len(found) == 1
    base, page, said = found[0]
    assert base == ladder.BUILDS_ON[rung]
    assert page == PAGES.get(base, base)
    lines = [line for line in re.findall(r"`([^`]+)`", said) if " = " in line]
    wanted = {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in ladder.changes(rung).items()
    }
    assert tomllib.loads("\n".join(lines)) == wanted


@pytest.mark.parametrize("page", sorted(set(PAGES.values())))
def test_a_picture_has_a_caption_that_names_its_rungs_its_seeds_and_its_band(page):
    text = text_of(page)
    pictures = re.findall(PICTURE, text, re.DOTALL | re.MULTILINE)
    assert len(pictures) == text.count("pictures/ladder/")
    for alternative, drawn, caption in pictures:
        words = " ".join(caption.split())
        assert f": {drawn} and " in alternative
        assert f": {drawn} and " in words
        assert re.search(r"; n = \d+ training seeds", words)
        assert "; line: " in words
        assert "; band: its 95% " in words


def test_every_page_of_the_ladder_is_in_its_list_and_in_the_site():
    nav = (LADDER.parents[1] / "mkdocs.yml").read_text("utf-8")
    index = text_of("index")
    for page in LADDER.glob("*.md"):
        assert f"ladder/{page.name}" in nav
        assert page.stem in {"index"} or f"({page.name})" in index
