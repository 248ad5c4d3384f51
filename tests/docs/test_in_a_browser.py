"""The documentation as a person meets it: in Chromium, in a window and on a phone, in the dark."""

from collections.abc import Generator
from pathlib import Path

import pytest
import site_of_pages
from playwright.sync_api import Page as Tab

from chromium import chromium

DOCS = site_of_pages.ROOT / "docs"
WIDTHS = (1280, 375)
PAGES = ("index.md", "ladder/rainbow.md", "ladder/results.md", "ladder/tabular-lander.md")
"""The home page, the longest equations, the widest table and the longest lines of code."""

CUT_OFF = """() => {
  const within = (each) => each.getBoundingClientRect().right <= innerWidth + 1;
  const scrolls = (each) => /auto|scroll/.test(getComputedStyle(each).overflowX) && within(each);
  return [...document.querySelectorAll('.md-content *')].filter((each) => {
    if (within(each)) return false;
    let above = each.parentElement;
    while (above && !scrolls(above)) above = above.parentElement;
    return !above;
  }).map((each) => `${each.tagName}: ${each.textContent.slice(0, 60)}`);
}"""
"""What reaches beyond the window and lies in nothing that scrolls."""


@pytest.fixture(scope="module")
def tab() -> Generator[Tab]:
    with chromium() as browser:
        tab = browser.new_page(color_scheme="dark")
        said: list[str] = []
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.on("request", lambda request: said.append(request.url) if "file:" not in request.url[:5]
               and "data:" not in request.url[:5] else None)  # fmt: skip
        yield tab
        assert said == []  # no error, and nothing fetched


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    built = site_of_pages.build(folder, {name: (DOCS / name).read_text("utf-8") for name in PAGES})
    assert built.returncode == 0, built.stderr
    return folder / "site"


def look_at(tab: Tab, page: Path) -> None:
    tab.goto(page.as_uri(), wait_until="domcontentloaded")
    for width in WIDTHS:
        tab.set_viewport_size({"width": width, "height": 800})
        assert tab.evaluate("document.documentElement.scrollWidth") <= width, page
        assert tab.evaluate(CUT_OFF) == [], page


@pytest.mark.parametrize("name", PAGES)
def test_nothing_is_cut_off_in_a_window_or_on_a_phone(tab: Tab, site: Path, name: str):
    look_at(tab, (site / name).with_suffix(".html"))


def test_a_long_equation_scrolls_within_itself_on_a_phone(tab: Tab, site: Path):
    tab.goto((site / "ladder" / "rainbow.html").as_uri())
    tab.set_viewport_size({"width": 375, "height": 800})
    inside, outside = tab.evaluate("""() => {
      const equation = document.querySelector('.equation');
      return [equation.scrollWidth, equation.clientWidth];
    }""")
    assert outside <= 375 < inside


def test_a_figure_lies_on_a_light_card_in_the_dark_and_the_landing_does_not(tab: Tab, site: Path):
    look = """() => [...document.querySelectorAll('.md-content img')].map((each) =>
      [getComputedStyle(each).backgroundColor, getComputedStyle(each).paddingLeft !== '0px'])"""
    tab.goto((site / "ladder" / "rainbow.html").as_uri())
    assert tab.evaluate(look) == [["rgb(255, 255, 255)", True]] * 2
    tab.goto((site / "index.html").as_uri())
    assert tab.evaluate(look) == [["rgba(0, 0, 0, 0)", False]]


def test_the_home_page_shows_a_landing_the_commands_and_three_doors(tab: Tab, site: Path):
    tab.goto((site / "index.html").as_uri())
    assert tab.get_by_role("img", name="lands").evaluate("each => each.naturalWidth") > 300
    assert "make land" in tab.locator("pre").first.inner_text()
    doors = [door.inner_text() for door in tab.locator(".grid.cards strong").all()]
    assert doors == ["Learn", "Compare", "Use"]


def test_the_home_page_lets_a_visitor_fly_without_leaving_it(tab: Tab, site: Path):
    tab.set_viewport_size({"width": 1280, "height": 900})
    tab.goto((site / "index.html").as_uri())
    tab.locator("iframe.playground").scroll_into_view_if_needed()  # it loads when it is in sight
    inside = tab.frame_locator("iframe.playground")
    inside.get_by_role("button", name="Fly", exact=True).click()
    tab.keyboard.press("ArrowUp")
    assert inside.locator("p[role=status]").inner_text() == "You are flying."
    alone = tab.get_by_role("link", name="Open the playground in a window of its own")
    assert alone.evaluate("each => each.href") == (site / "play.html").as_uri()


@pytest.mark.slow
def test_no_page_of_the_whole_site_is_cut_off(tab: Tab, tmp_path: Path):
    pages = {str(page.relative_to(DOCS)): page.read_text("utf-8") for page in DOCS.rglob("*.md")}
    built = site_of_pages.build(tmp_path, pages)
    assert built.returncode == 0, built.stderr
    found = sorted((tmp_path / "site").rglob("*.html"))
    assert len(found) > len(pages)  # with the page for what is not found
    for page in found:
        look_at(tab, page)
