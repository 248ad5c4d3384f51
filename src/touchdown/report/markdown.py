"""A page's verdicts and figures as Markdown, for viewers without HTML."""

import os
from pathlib import Path

from touchdown.core import markdown
from touchdown.report.page import Page, Section


def summary_of(page: Page, out: Path, page_name: str) -> str:
    """A summary of the page: a table of its claims, and its figures.

    Args:
        page: a page whose pictures are on disk.
        out: folder of the text, from which the pictures are linked.
        page_name: the HTML page's file name in that folder.
    """
    parts = [
        f"# {markdown.text(page.title)}",
        markdown.text(page.lead),
        f"[The page]({page_name}) also has the films and the tables of levels and runs.",
        "\n".join(f"- {name}: {_fact(name, value)}" for name, value in page.provenance),
        *(_section(section, out) for section in page.sections),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _fact(name: str, value: str) -> str:
    return markdown.code(value) if name == "made by" else markdown.text(value)


def _section(section: Section, out: Path) -> str:
    parts = [f"## {markdown.text(section.title)}", markdown.text(section.lead)]
    if section.claims:
        parts.append(_claims(section))
    parts += [
        f"{markdown.image(picture.alt, Path(os.path.relpath(picture.png, out)))}"
        f"\n\n{markdown.text(picture.caption)}"
        for picture in section.pictures
    ]
    return "\n\n".join(part for part in parts if part)


def _claims(section: Section) -> str:
    """A table of the claims, with their sections if they come from a paper."""
    of_paper = any(claim.section for claim in section.claims)
    rows = [("claim", *["section"] * of_paper, "verdict", "numbers")]
    rows += [("---",) * len(rows[0])]
    rows += [
        (
            markdown.text(claim.sentence),
            *[markdown.text(claim.section)] * of_paper,
            f"**{claim.verdict}**",
            markdown.text(claim.evidence),
        )
        for claim in section.claims
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)
