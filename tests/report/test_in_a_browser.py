"""The page as a person meets it: in Chromium, wide and narrow, light and dark."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

import pytest
import sample_page
from playwright.sync_api import Browser
from playwright.sync_api import Page as Tab

from chromium import chromium
from contrast import contrast
from touchdown.report.page import write_page

SIZES = {"desktop": (1280, 900), "phone": (375, 760)}
Open = Callable[..., Any]


@pytest.fixture(scope="module")
def browser() -> Generator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("page")
    write_page(sample_page.page(folder), folder / "index.html")
    return (folder / "index.html").as_uri()


@pytest.fixture
def opened(browser: Browser, url: str) -> Open:
    @contextmanager
    def open_page(size: str = "desktop", at: str = "", **settings: Any) -> Generator[Tab]:
        width, height = SIZES[size]
        context = browser.new_context(viewport={"width": width, "height": height}, **settings)
        tab = context.new_page()
        said: list[str] = []
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.on("request", lambda request: _note_request(said, request.url))
        tab.goto(url + at)
        yield tab
        context.close()
        assert said == []  # nothing on the console, and nothing fetched

    return open_page


def _note_request(said: list[str], address: str) -> None:
    if not address.startswith(("file:", "data:")):
        said.append(address)


def background(tab: Tab) -> str:
    return tab.evaluate("getComputedStyle(document.body).backgroundColor")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES)
def test_the_page_never_scrolls_sideways_and_all_pictures_load(
    opened: Open, size: str, scheme: str
):
    with opened(size, color_scheme=scheme) as tab:
        tab.evaluate("document.querySelectorAll('details').forEach((each) => each.open = true)")
        assert tab.evaluate("document.documentElement.scrollWidth") == SIZES[size][0]
        widths = tab.evaluate("[...document.images].map((each) => each.naturalWidth)")
        assert widths
        assert min(widths) > 0
        drawings = "[...document.querySelectorAll('.card svg')].map((s) => s.clientHeight)"
        assert min(tab.evaluate(drawings)) > 100


def test_light_and_dark_follow_the_system_and_the_button_turns_them(opened: Open):
    with opened(color_scheme="light") as tab:
        light = background(tab)
    with opened(color_scheme="dark") as tab:
        dark = background(tab)
        tab.get_by_role("button", name="Switch between light and dark").click()
        assert background(tab) == light
        tab.reload()
        assert background(tab) == light  # it remembers
    assert light != dark


def test_a_figures_ink_is_readable_on_its_card_in_the_dark(opened: Open):
    look = """() => {
      const card = document.querySelector(".card:not(.paper)");
      const letters = card.querySelector("[style*='--ink']");
      return [getComputedStyle(letters).fill, getComputedStyle(card).backgroundColor];
    }"""
    with opened(color_scheme="dark") as tab:
        ink, card = tab.evaluate(look)
    assert contrast(ink, card) > 7


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_stand_out_from_what_is_behind_them(opened: Open, scheme: str):
    look = """() => [...document.querySelectorAll(".badge, .lead, .evidence, .about, .brand, "
        + "caption, nav a, dt, figcaption, thead th, .larger, summary")].map((each) => {
      let behind = each;
      while (getComputedStyle(behind).backgroundColor === "rgba(0, 0, 0, 0)")
        behind = behind.parentElement;
      return [each.className, getComputedStyle(each).color,
              getComputedStyle(behind).backgroundColor];
    })"""
    with opened(color_scheme=scheme) as tab:
        found = tab.evaluate(look)
    assert [each for each in found if contrast(*each[1:]) < 4.5] == []  # WCAG 2.2, 1.4.3


@pytest.mark.parametrize(("motion", "first"), [("no-preference", "moving"), ("reduce", "still")])
def test_a_film_moves_unless_less_motion_is_wanted_and_can_be_turned_by_keyboard(
    opened: Open, motion: str, first: str
):
    other = {"moving": "still", "still": "moving"}[first]
    with opened(reduced_motion=motion) as tab:
        screen = tab.locator(".screen").first
        assert screen.locator(f".{first}").is_visible()
        assert not screen.locator(f".{other}").is_visible()
        name = "Pause the film" if first == "moving" else "Play the film"
        tab.get_by_role("checkbox", name=name).first.focus()
        tab.keyboard.press("Space")
        assert screen.locator(f".{other}").is_visible()
        assert not screen.locator(f".{first}").is_visible()


def test_the_letters_of_a_figure_and_the_answer_of_a_table_are_readable_on_a_phone(opened: Open):
    with opened("phone") as tab:
        # 8 points of a figure 7.2 inches wide
        width = tab.locator("figure svg").first.bounding_box()["width"]
        assert width * 8 / (7.2 * 72) > 9
        assert tab.locator(".card").first.bounding_box()["width"] < SIZES["phone"][0]
        inside = tab.locator(".scroll").first
        inside.evaluate("each => each.scrollLeft = 200")
        name = inside.locator("tbody th").first.bounding_box()
        assert abs(name["x"] - inside.bounding_box()["x"]) < 2  # still in sight
        assert inside.locator("caption span").bounding_box()["width"] < 340


def test_a_figure_opens_larger_and_closes_again_without_a_script(opened: Open):
    with opened("phone", java_script_enabled=False) as tab:
        small = tab.locator("figure svg").first.bounding_box()
        tab.get_by_role("link", name="Figure 1, larger").click()
        large = tab.locator("figure svg").first.bounding_box()
        assert large["width"] > 1.5 * small["width"]
        tab.get_by_role("link", name="Figure 1, back to the page").click()
        assert tab.locator("figure svg").first.bounding_box()["width"] == small["width"]


def test_a_page_without_scripts_lacks_only_the_button(opened: Open):
    with opened(java_script_enabled=False) as tab:
        assert not tab.get_by_role("button").count()
        assert tab.get_by_role("heading", name="All claims").is_visible()
        tab.get_by_text("The 60 runs of this study.").first.click()
        assert tab.locator("details table").first.is_visible()


def test_a_heading_that_a_link_leads_to_is_in_sight_below_the_strip(opened: Open):
    with opened("phone", at="#topic-2", reduced_motion="reduce") as tab:
        strip = tab.locator("nav").bounding_box()
        heading = tab.locator("#topic-2 h2").bounding_box()
        assert strip["y"] + strip["height"] < heading["y"] < 300
