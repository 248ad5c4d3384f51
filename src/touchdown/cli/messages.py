"""Error messages from tyro, shortened to one line."""

import re


def one_line_of(complaint: str) -> str:
    """An error message from tyro on one line, without its frame and title."""
    return re.sub(r"^Error parsing ((?!--)\S+: )?", "", _first_paragraph(complaint))


def _first_paragraph(complaint: str) -> str:
    """The first paragraph of tyro's message, without its frame and title.

    Ruled lines separate paragraphs. If the terminal does not support UTF-8, there is no frame and
    the title is a separate paragraph.
    """
    paragraphs: list[list[str]] = [[]]
    for line in complaint.splitlines():
        text = line.strip(" │")
        if text[:1] in ("╭", "╰"):
            continue
        if text and not text.strip("─-"):
            paragraphs.append([])
        else:
            paragraphs[-1].append(text)
    framed = "╭" in complaint
    return " ".join(" ".join(paragraphs[0 if framed else 1]).split())
