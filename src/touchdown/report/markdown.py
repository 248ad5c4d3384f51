"""A page's verdicts and figures as Markdown, for viewers without HTML."""

import os
from pathlib import Path

from touchdown.report.page import Page, Section


def summary_of(page: Page, out: Path, page_name: str) -> str:
    """A summary of the page: a table of its claims, and its figures.

    Args:
        page: a page whose pictures are on disk.
        out: folder of the text, from which the pictures are linked.
        page_name: the HTML page's file name in that folder.
    """
    parts = [
        f"# {page.title}",
        page.lead,
        f"[The page]({page_name}) also has the flights and the tables of levels and runs.",
        "\n".join(f"- {name}: {_code(name, value)}" for name, value in page.provenance),
        *(_section(section, out) for section in page.sections),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _code(name: str, value: str) -> str:
    return f"`{value}`" if name == "made by" else value


def _section(section: Section, out: Path) -> str:
    parts = [f"## {section.title}", section.lead]
    if section.claims:
        parts.append(_claims(section))
    parts += [
        f"![{picture.alt}]({Path(os.path.relpath(picture.png, out)).as_posix()})"
        f"\n\n{picture.caption}"
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
            _cell(claim.sentence),
            *[claim.section] * of_paper,
            f"**{claim.verdict}**",
            _cell(claim.evidence),
        )
        for claim in section.claims
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
