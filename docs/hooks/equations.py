"""Turns a page's equations into MathML when the site is built: no script, nothing is fetched.

An equation is a fenced block ```math or inline `$...$`, as code hosts render them too.
`pymdownx.arithmatex` finds them, so that code stays as it is; this module converts what it found.
"""

import html
import re
from typing import Any

from math_core import LatexError, LatexToMathML
from mkdocs.exceptions import PluginError
from mkdocs.structure.pages import Page

_CONVERTER = LatexToMathML(fancy_error=False)
_DISPLAY = re.compile(r'<div class="arithmatex">\\\[(.*?)\\\]</div>', re.DOTALL)
# with what follows it without a space, so that no line begins with a comma
_INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>([^\s<]*)', re.DOTALL)


def on_page_content(content: str, page: Page, **_: Any) -> str:
    """MkDocs calls this with each page's HTML.

    Raises:
        PluginError: an equation is wrong; the build ends with this one line.
    """
    try:
        return with_mathml(content)
    except ValueError as error:
        raise PluginError(f"{page.file.src_uri}: {error}") from None


def with_mathml(content: str) -> str:
    """Replace the equations in HTML that arithmatex marked.

    Raises:
        ValueError: an equation is wrong.
    """
    # arithmatex escapes inline equations only
    content = _DISPLAY.sub(
        lambda found: f'<div class="equation">{to_mathml(found[1], display=True)}</div>', content
    )
    return _INLINE.sub(_inline, content)


def _inline(found: re.Match[str]) -> str:
    math = to_mathml(html.unescape(found[1]), display=False)
    return f'<span class="together">{math}{found[2]}</span>' if found[2] else math


def to_mathml(latex: str, *, display: bool) -> str:
    """A `<math>` element.

    Raises:
        ValueError: it is not LaTeX that can be converted.
    """
    latex = latex.strip()
    try:
        return _CONVERTER.convert_with_local_state(latex, displaystyle=display)
    except LatexError as error:
        _, _, reason = str(error).partition(": ")  # after the place in the equation
        raise ValueError(f"equation `{' '.join(latex.split())}`: {reason}") from None
