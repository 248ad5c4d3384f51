"""Error messages from tyro, shortened to one line."""

import re
from collections.abc import Mapping

from touchdown.config.fields import nearest


def one_line_of(complaint: str, verb: str, flags: Mapping[str, str]) -> str:
    """An error message from tyro on one line; for an unknown flag it suggests the closest one.

    Args:
        complaint: text printed by tyro.
        verb: the verb given, such as `train` or `tune agent`.
        flags: the verb's flags, such as `--seed`, each with the flag to suggest for it, which
            differs for a former name; empty if there is no such verb.
    """
    text = re.sub(r"^Error parsing (__tyro\S*: )?", "", _first_paragraph(complaint))
    unknown = re.match(r"Unrecognized options: (--[^\s,=]+)", text)
    if not unknown or not flags:
        return text
    near = nearest(unknown[1].replace("_", "-"), flags)
    hint = f"did you mean {flags[near]}?" if near else f"`touchdown {verb} --help` lists them"
    return f"{unknown[1]}: unknown option; {hint}"


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
