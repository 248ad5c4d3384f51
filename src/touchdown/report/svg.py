"""Adapts matplotlib's SVG for embedding in a page, in light and dark mode."""

import re
from xml.etree import ElementTree

from touchdown.figures import style

# shapes and text; everything else that an SVG may contain is left out
_SHAPES = frozenset(
    ("svg", "g", "defs", "path", "use", "clipPath", "rect", "circle", "ellipse", "line",
     "polyline", "polygon", "image", "text", "tspan", "linearGradient", "radialGradient", "stop",
     "marker", "pattern")
)  # fmt: skip
_VARIABLES = {
    style.INK: "--ink",
    style.MUTED: "--muted",
    style.FAINT: "--line",
    style.BLUE: "--blue",
    style.ORANGE: "--orange",
    style.GREEN: "--green",
    style.RED: "--red",
    style.PURPLE: "--purple",
}
_COLOUR = re.compile("|".join(_VARIABLES), re.IGNORECASE)
_WHITE = re.compile(r"#fff(?:fff)?\b|\bwhite\b", re.IGNORECASE)
_REFERENCE = re.compile(r"url\(#")
_ELSEWHERE = re.compile(r"url\((?!#)|javascript:", re.IGNORECASE)


def themed_svg(text: str, prefix: str) -> str:
    """An SVG's shapes with unique ids, and with our colours as variables of the page.

    White backgrounds and outlines get the colour of the card behind the picture. White letters stay
    white, since the colour behind them does not change.

    Args:
        text: text of the file.
        prefix: prefix of its ids, so that pictures on one page do not conflict.

    Raises:
        ValueError: it is not an SVG.
    """
    try:
        root = ElementTree.fromstring(text)  # noqa: S314 - a file of the user's own
    except ElementTree.ParseError as error:
        raise ValueError(str(error)) from None
    if _bare(root.tag) != "svg":
        raise ValueError(f"its root is {_bare(root.tag)!r}")
    for element in list(root.iter()):
        for child in list(element):
            if _bare(child.tag) not in _SHAPES:
                element.remove(child)
    for element in root.iter():
        element.tag = _bare(element.tag)
        if element.tag not in ("text", "tspan"):
            element.text = None
        element.tail = element.tail if element.tag == "tspan" else None
        attributes = {_bare(name): value for name, value in element.attrib.items()}
        element.attrib.clear()
        for name, value in attributes.items():
            kept = _attribute(element.tag, name, value, prefix)
            if kept is not None:
                element.set(name, kept)
    for name in ("width", "height", "version"):
        root.attrib.pop(name, None)
    # matplotlib sets this in a style sheet, which would apply to the whole page
    root.set("stroke-linejoin", "round")
    root.set("stroke-linecap", "butt")
    return ElementTree.tostring(root, "unicode")


def _bare(name: str) -> str:
    """A name without its namespace, which HTML does not need."""
    return name.rpartition("}")[2]


def _attribute(tag: str, name: str, value: str, prefix: str) -> str | None:
    """The value of an attribute in the page; None leaves it out."""
    if name.lower().startswith("on") or _ELSEWHERE.search(value):
        return None
    if name == "id":
        return prefix + value
    if name == "href":
        if value.startswith("#"):
            return f"#{prefix}{value[1:]}"
        return value if tag == "image" and value.startswith("data:image/png;base64,") else None
    if name in ("style", "fill", "stroke", "stop-color"):
        value = _COLOUR.sub(lambda found: f"var({_VARIABLES[found[0].lower()]})", value)
        if tag in ("path", "rect", "use"):
            value = _WHITE.sub("var(--card)", value)
    return _REFERENCE.sub(f"url(#{prefix}", value)
