"""A self-contained HTML page from a plain value: no network, and complete without its script."""

import os
import re
from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from urllib.parse import quote

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from touchdown.core import files, limits, reading
from touchdown.core.errors import UserError, one_line
from touchdown.core.terminal import printable
from touchdown.report.embed import data_url, film_and_still
from touchdown.report.svg import themed_svg
from touchdown.studies.findings import VERDICTS, Verdict

_SECTION_ID = re.compile(r"[^\s:]+")  # the page's own ids have a colon
# cells that are compared down a column: a number with its unit or interval, or no number
_NUMBER = re.compile(r"[<>≤≥≈]? ?[+−±-]?\.?\d[\d.,]*(e[+-]?\d+)? ?[%kMms]?( ?(±|\[|\(|to ).*)?")
_NO_NUMBER = re.compile(r"|[–—-]|never( \(.*\))?")
# browsers drop control characters and read backslashes as slashes before they look for a scheme
_PLAIN = r"[^\\\x00-\x20\x7f][^\\\x00-\x1f\x7f]*"
_SAFE_HREF = re.compile(rf"https?://{_PLAIN}|(?!/|[^/?#]*:){_PLAIN}", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class ClaimRow:
    """A claim, its verdict, and the numbers that decided it."""

    sentence: str
    section: str
    """Section of the paper; "" for a claim that is not the paper's."""
    verdict: Verdict
    evidence: str
    """One line of evidence."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure: its SVG is embedded and follows light and dark mode; without an SVG, its PNG."""

    svg: Path | None
    png: Path
    alt: str
    caption: str


@dataclass(frozen=True, slots=True)
class Film:
    """An animation; readers who prefer less motion see its last frame and start it manually."""

    gif: Path
    alt: str
    caption: str


@dataclass(frozen=True, slots=True)
class Link:
    """Text that links to a place relative to the page, or over http.

    Raises:
        UserError: the URL is absolute, or of another kind.
    """

    text: str
    href: str

    def __post_init__(self) -> None:
        if not _SAFE_HREF.fullmatch(self.href):
            raise UserError(f"href = {self.href!r}: must be a relative path, or http or https")

    @classmethod
    def to_file(cls, text: str, path: Path) -> "Link":
        """A link to a file with any name.

        Args:
            text: text of the link.
            path: path relative to the page.
        """
        return cls(text, quote(os.fsencode(path.as_posix())))  # even bytes that are no text


TableCell = str | Link


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of cells, each headed by its first cell; the reader opens a folded table."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[TableCell, ...], ...]
    folded: bool = False

    @property
    def numeric(self) -> list[bool]:
        """For each column, whether its cells are numbers, which are aligned to the right."""
        return [
            _are_numbers([row[place] for row in self.rows if place < len(row)])
            for place in range(len(self.columns))
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """One topic of a page.

    Raises:
        UserError: the id has blanks or colons.
    """

    id: str
    """Target of links to the section, without blanks and colons."""
    title: str
    lead: str = ""
    claims: tuple[ClaimRow, ...] = ()
    pictures: tuple[Picture, ...] = ()
    films: tuple[Film, ...] = ()
    tables: tuple[Table, ...] = ()

    def __post_init__(self) -> None:
        if not _SECTION_ID.fullmatch(self.id):
            raise UserError(f"section {self.id!r}: must have an id without blanks and colons")

    @property
    def counts(self) -> list[tuple[Verdict, int]]:
        """How many claims have each verdict; verdicts without a claim are left out."""
        return [(verdict, number) for verdict, number in _counted(self.claims) if number]


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """A complete report."""

    title: str
    lead: str
    facts: tuple[tuple[str, str], ...] = ()
    """Name and value of the main facts."""
    sections: tuple[Section, ...] = ()
    provenance: tuple[tuple[str, str], ...] = ()
    """Name and value of facts about the origin of the numbers."""

    @property
    def counts(self) -> list[tuple[Verdict, int]]:
        """How many claims have each verdict."""
        return _counted(claim for section in self.sections for claim in section.claims)


def render(page: Page) -> str:
    """The page as HTML; the same value, and the same pictures, give the same text.

    Raises:
        UserError: a picture cannot be read, or two sections have the same id.
    """
    times = Counter(section.id for section in page.sections)
    for name in times:
        if times[name] > 1:
            raise UserError(f"section {name!r}: exists {times[name]} times, must exist once")
    environment = Environment(
        loader=ChoiceLoader(
            [PackageLoader(f"touchdown.{package}", ".") for package in ("report", "figures")]
        ),
        autoescape=True,
        finalize=_shown,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    script = environment.get_template("theme.js").render()
    return environment.get_template("page.html.j2").render(
        page=page,
        drawing_of=_drawing,
        address_of=data_url,
        moving_of=film_and_still,
        script=Markup(script),  # noqa: S704 - our own
        # the only script that a browser may run here, even if a run's name contains another
        script_hash=b64encode(sha256(script.encode()).digest()).decode(),
    )


def write_page(page: Page, path: Path) -> None:
    """Write the page, completely or not at all.

    Raises:
        UserError: a picture cannot be read, or the page cannot be written.
    """
    text = render(page)
    with files.refusing(str(path)):
        files.write_atomic(path, text)


def _counted(claims: Iterable[ClaimRow]) -> list[tuple[Verdict, int]]:
    counted = Counter(claim.verdict for claim in claims)
    if counted["preview"]:
        return [("preview", counted["preview"])]
    return [(verdict, counted[verdict]) for verdict in VERDICTS.values()]


def _are_numbers(cells: Sequence[TableCell]) -> bool:
    texts = [cell for cell in cells if isinstance(cell, str)]
    found = [_NUMBER.fullmatch(text) is not None for text in texts]
    return (
        len(texts) == len(cells)
        and any(found)
        and all(
            is_number or _NO_NUMBER.fullmatch(text)
            for is_number, text in zip(found, texts, strict=True)
        )
    )


def _shown(value: object) -> object:
    """A value of the page's as text of any file; our own markup and numbers as they are."""
    return printable(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def _drawing(svg: Path, prefix: str) -> Markup:
    try:
        text = reading.read_bytes(svg, limits.PICTURE_BYTES).decode("utf-8")
        return Markup(themed_svg(text, prefix))  # noqa: S704 - only shapes
    except ValueError as error:
        raise UserError(f"{svg}: not an SVG picture: {one_line(error)}") from None
