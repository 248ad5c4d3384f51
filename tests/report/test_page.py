import dataclasses
import io
from base64 import b64decode, b64encode
from collections import Counter
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path

import pytest
import sample_page
from PIL import Image

from touchdown.core.errors import UserError
from touchdown.report.page import (
    ClaimRow,
    Film,
    Link,
    Page,
    Picture,
    Section,
    Table,
    render,
    write_page,
)

EMPTY = Page(title="Nothing yet", lead="")
CLAIMS = tuple(
    ClaimRow(f"claim {place}", "8", verdict, f"evidence {place}")
    for place, verdict in enumerate(("holds", "undecided", "holds", "does not hold", "holds"))
)


class Reader(HTMLParser):
    """What a browser would see: elements with their attributes, and texts."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.texts: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def all(self, *tags: str) -> list[dict[str, str]]:
        return [attributes for tag, attributes in self.elements if tag in tags]

    def values(self, *names: str) -> list[str]:
        return [each[name] for _, each in self.elements for name in names if name in each]


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Page:
    return sample_page.page(tmp_path_factory.mktemp("pictures"), runs=10)


@pytest.fixture(scope="module")
def read(sample: Page) -> Reader:
    return Reader(render(sample))


def with_section(**parts: object) -> Page:
    section = dataclasses.replace(Section(id="one", title="One"), **parts)
    return dataclasses.replace(EMPTY, sections=(section,))


def addresses(html: str, media_type: str) -> list[bytes]:
    start = f"data:{media_type};base64,"
    found = Reader(html).values("src")
    return [b64decode(each.removeprefix(start)) for each in found if each.startswith(start)]


def test_every_fact_claim_picture_film_and_table_is_on_the_page(sample: Page, read: Reader):
    texts = Counter(text.strip() for text in read.texts)
    labels = read.values("aria-label", "alt")
    for name, value in (*sample.facts, *sample.provenance):
        assert texts[name]
        assert texts[value]
    for section in sample.sections:
        for claim in section.claims:
            assert texts[claim.sentence]
            assert texts[claim.evidence]
        for picture in section.pictures:
            assert picture.alt in labels
            assert any(picture.caption in text for text in texts)
        for film in section.films:
            assert film.alt in labels
            assert texts[film.caption]
        for table in section.tables:
            assert texts[table.caption]
            assert table.caption in labels
            for cell in (cell for row in table.rows for cell in row):
                assert texts[cell.text if isinstance(cell, Link) else cell]
    pictures = sum(len(section.pictures) for section in sample.sections)
    assert len([each for each in read.all("figure") if "id" in each]) == pictures


def test_names_that_are_html_stay_text(read: Reader):
    assert any(sample_page.HOSTILE in text for text in read.texts)  # as it is, and not as 49
    assert len(read.all("script")) == 1
    assert "x" not in read.values("src")
    assert not [name for _, each in read.elements for name in each if name.startswith("on")]


def test_a_browser_runs_no_script_but_the_pages_own(read: Reader):
    policy = next(each["content"] for each in read.all("meta") if "http-equiv" in each)
    script = next(text for text in read.texts if "localStorage" in text)
    expected = b64encode(sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{expected}'" in policy
    assert policy.startswith("default-src 'none'")


def test_nothing_is_fetched_from_elsewhere():
    rows = (("1", Link("paper", "https://example.org/paper")), ("2", Link("run", "../runs/a")))
    read = Reader(render(with_section(tables=(Table("", ("n", "where"), rows),))))
    others = [each for each in read.values("href", "src") if not each.startswith(("#", "data:"))]
    assert others == ["https://example.org/paper", "../runs/a"]
    assert read.all("link") == [{"rel": "icon", "href": "data:,"}]
    assert not [text for text in read.texts if "@import" in text or "url(" in text]


def test_ids_are_unique_and_links_within_the_page_lead_somewhere(read: Reader):
    ids = Counter(read.values("id"))
    assert ids.most_common(1)[0][1] == 1
    within = [each[1:] for each in read.values("href") if each.startswith("#")]
    assert within
    assert not set(within) - set(ids)
    assert not set(read.values("for")) - set(ids)


def test_one_picture_twice_on_a_page_has_ids_of_its_own_each_time(tmp_path: Path):
    picture = sample_page.axis_picture(tmp_path / "axis")
    ids = Reader(render(with_section(pictures=(picture, picture)))).values("id")
    first, second = ([i[3:] for i in ids if i.startswith(start)] for start in ("f1:", "f2:"))
    assert len(first) > 10
    assert first == second


def test_headings_go_down_one_at_a_time(sample: Page, read: Reader):
    headings = [tag for tag, _ in read.elements if tag in {"h1", "h2", "h3", "h4", "h5", "h6"}]
    assert headings == ["h1"] + ["h2"] * (len(sample.sections) + 2)  # claims, provenance


def test_every_picture_says_what_it_shows(read: Reader):
    assert all(each["alt"] for each in read.all("img"))
    assert all(each["aria-label"] for _, each in read.elements if each.get("role") == "img")


def test_verdicts_are_counted_in_all_and_by_section():
    page = dataclasses.replace(
        EMPTY,
        sections=(
            Section(id="a", title="A", claims=CLAIMS[:2]),
            Section(id="b", title="B", claims=CLAIMS[2:]),
        ),
    )
    assert page.counts == [
        ("holds", 3),
        ("reached and exceeded", 0),
        ("no difference that matters", 0),
        ("does not hold", 1),
        ("undecided", 1),
    ]
    assert page.sections[0].counts == [("holds", 1), ("undecided", 1)]


def test_a_verdict_is_a_word_beside_its_sign():
    texts = [text.strip() for text in Reader(render(with_section(claims=CLAIMS))).texts]
    # the counts; the list of contents; the overview and the section
    assert [texts.count(each) for each in ("holds", "does not hold", "undecided")] == [8, 4, 4]


def test_a_page_without_claims_has_no_overview_of_them():
    read = Reader(render(with_section()))
    assert "page:claims" not in read.values("id")
    assert "All claims" not in read.texts


def test_columns_of_numbers_stand_at_the_right():
    rows = (
        ("800", "0", "171 [108, 223]", "never (2 of 5)", "< 0.001", "+12", "12%", "e3b0"),
        ("3000", "1", "-12 [-30, 6]", "60,997", "0.21", "–", "never", "0044"),
        ("x", "2", "92 to 240", "1,024 (4 of 5)", "3.2k", "−1.5", "98%", "1e-3"),
    )
    table = Table("", ("level", "seed", "mean", "to 200", "p", "base", "better", "run"), rows)
    assert table.numeric == [False, True, True, True, True, True, True, False]


def test_columns_of_links_and_columns_without_a_number_stand_at_the_left():
    rows = (("–", Link("1", "a")), ("never", Link("2", "b")))
    assert Table("", ("to 200", "run"), rows).numeric == [False, False]
    assert Table("", ("to 200",), ()).numeric == [False]


def test_cells_are_headed_by_their_column_and_row():
    read = Reader(render(with_section(tables=(Table("c", ("a", "b"), (("x", "1"), ("y", "2"))),))))
    assert [each["scope"] for each in read.all("th")] == ["col", "col", "row", "row"]
    assert len(read.all("td")) == 2


def test_a_folded_table_opens_by_hand():
    table = Table("The 2 runs.", ("a",), (("x",),))
    assert not Reader(render(with_section(tables=(table,)))).all("details")
    folded = render(with_section(tables=(dataclasses.replace(table, folded=True),)))
    assert Reader(folded).all("details") == [{}]


def test_a_film_comes_with_its_last_frame_for_whoever_wants_less_motion(tmp_path: Path):
    film = sample_page.film(tmp_path / "film.gif")  # its frames are 0, 80 and 160 red
    html = render(with_section(films=(film,)))
    assert addresses(html, "image/gif") == [film.gif.read_bytes()]
    (still,) = addresses(html, "image/png")
    with Image.open(io.BytesIO(still)) as picture:
        assert picture.size == (60, 40)
        assert picture.convert("RGB").getpixel((5, 5)) == (160, 40, 200)


def test_a_picture_without_an_svg_is_its_png(tmp_path: Path):
    picture = dataclasses.replace(sample_page.axis_picture(tmp_path / "axis"), svg=None)
    html = render(with_section(pictures=(picture,)))
    assert addresses(html, "image/png") == [picture.png.read_bytes()]


def test_a_picture_with_pixels_lies_on_paper_in_the_dark_too(tmp_path: Path):
    mapped = sample_page.map_picture(tmp_path / "map")
    curves = sample_page.axis_picture(tmp_path / "axis")
    read = Reader(render(with_section(pictures=(mapped, curves))))
    cards = [each["class"] for each in read.all("div") if "card" in each.get("class", "")]
    assert cards == ["card paper", "card"]


@pytest.mark.parametrize("missing", ["svg", "png", "gif"])
def test_a_missing_picture_is_named_in_one_line(tmp_path: Path, missing: str):
    path = tmp_path / f"gone.{missing}"
    page = {
        "svg": with_section(pictures=(Picture(path, path, "", ""),)),
        "png": with_section(pictures=(Picture(None, path, "", ""),)),
        "gif": with_section(films=(Film(path, "", ""),)),
    }[missing]
    with pytest.raises(UserError) as caught:
        render(page)
    assert str(caught.value) == f"{path}: cannot be read: No such file or directory"


@pytest.mark.parametrize(
    ("name", "holds"),
    [
        ("cut.svg", b"<svg xmlns='http://www.w3.org/2000/svg'><g>"),
        ("page.svg", b"<html/>"),
        ("bytes.svg", b"\xff\xfe\x00"),
        ("empty.gif", b""),
        ("cut.gif", b"GIF89a\x01"),
    ],
)
def test_a_broken_picture_is_named_in_one_line(tmp_path: Path, name: str, holds: bytes):
    path = tmp_path / name
    path.write_bytes(holds)
    page = (
        with_section(pictures=(Picture(path, path, "", ""),))
        if path.suffix == ".svg"
        else with_section(films=(Film(path, "", ""),))
    )
    with pytest.raises(UserError) as caught:
        render(page)
    said = str(caught.value)
    assert said.startswith(f"{path}: not a")
    assert "\n" not in said


@pytest.mark.parametrize(
    "href",
    [
        "javascript:alert(1)",
        "JavaScript:alert(1)",
        "java\tscript:alert(1)",
        " javascript:alert(1)",
        "\x01javascript:alert(1)",
        "data:text/html,x",
        "file:///etc/passwd",
        "mailto:a@b",
        "/etc/passwd",
        "//example.org",
        "\\\\example.org",
        "..\\..\\x",
        "https://",
        "",
    ],
)
def test_a_link_leads_beside_the_page_or_over_http(href: str):
    with pytest.raises(UserError, match="must be a relative path, or http or https"):
        Link("x", href)


@pytest.mark.parametrize(
    "href",
    [
        "a.html",
        "../runs/a-0/",
        "./a:b",
        "#one",
        "a?b=c:d",
        "my runs/a",
        "http://a.org",
        "HTTPS://a.org/b",
    ],
)
def test_links_that_may_be_are(href: str):
    assert Link("x", href).href == href


def test_a_file_of_any_name_can_be_linked_to():
    link = Link.to_file("x", Path('../a b#c?d%e:f"<g>/curve.png'))
    assert link.href == "../a%20b%23c%3Fd%25e%3Af%22%3Cg%3E/curve.png"


@pytest.mark.parametrize("name", ["", "two words", "page:claims"])
def test_a_section_has_an_id_that_a_link_can_name(name: str):
    with pytest.raises(UserError, match="must have an id without blanks and colons"):
        Section(id=name, title="")


def test_two_sections_of_one_id_are_refused():
    section = Section(id="one", title="")
    with pytest.raises(UserError, match="section 'one': exists 2 times, must exist once"):
        render(dataclasses.replace(EMPTY, sections=(section, section)))


def test_the_same_page_is_the_same_text(sample: Page):
    assert render(sample) == render(sample)


def test_a_page_is_written_whole_in_utf8(tmp_path: Path):
    page = dataclasses.replace(EMPTY, title="ε and γ")
    write_page(page, tmp_path / "index.html")
    assert [each.name for each in tmp_path.iterdir()] == ["index.html"]
    assert (tmp_path / "index.html").read_text("utf-8") == render(page)


def test_a_page_that_cannot_be_written_is_named(tmp_path: Path):
    with pytest.raises(UserError, match=r"gone/index.html: cannot be written: No such file"):
        write_page(EMPTY, tmp_path / "gone" / "index.html")
