"""matplotlib's SVG, fit to stand in a page beside others, in light and in dark."""

import re
from xml.etree import ElementTree

from touchdown.figures import style

# shapes and words: whatever else an SVG may hold is left out
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
    """An SVG's shapes with ids of their own, and with the house's colours as the page's variables.

    What is white in the background, or around a shape, becomes the card that the picture lies on.
    White letters stay white, since what is behind them does not change.

    Args:
        text: of the file.
        prefix: of its ids, so that two pictures of one page do not meddle with each other.

    Raises:
        ValueError: it is no SVG.
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
    # matplotlib says this in a style sheet, which would hold for the whole page
    root.set("stroke-linejoin", "round")
    root.set("stroke-linecap", "butt")
    return ElementTree.tostring(root, "unicode")


def _bare(name: str) -> str:
    """Without its namespace: HTML needs none."""
    return name.rpartition("}")[2]


def _attribute(tag: str, name: str, value: str, prefix: str) -> str | None:
    """The value that an attribute has in the page; None leaves it out."""
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
