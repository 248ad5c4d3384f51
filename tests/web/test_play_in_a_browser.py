"""The playground as a person meets it: in Chromium, on a desk and on a phone, light and dark."""

import json
import shutil
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from javascript import ACE, MODULE, encoded, in_node
from playwright.sync_api import Browser, expect
from playwright.sync_api import Page as Tab

from chromium import chromium
from contrast import contrast
from touchdown.api import playing
from touchdown.lander.single import LanderEnv
from touchdown.policies import lookup
from touchdown.web import playground

DESK = {"viewport": {"width": 1280, "height": 800}}
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
Open = Callable[..., Any]


@pytest.fixture(scope="module")
def browser() -> Generator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("play") / "playground.html"
    path.write_text(playground.render(playing.offered(), seed=7), "utf-8")
    return path.as_uri()


@pytest.fixture
def opened(browser: Browser, url: str) -> Open:
    @contextmanager
    def open_page(
        at: str = "", script: str = "", page: str = url, **settings: Any
    ) -> Generator[Tab]:
        context = browser.new_context(**(DESK | {"reduced_motion": "reduce"} | settings))
        tab = context.new_page()
        tab.set_default_timeout(15_000)
        said: list[str] = []
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.on("request", lambda request: _note_request(said, request.url))
        tab.add_init_script(script)
        tab.goto(page + at)
        tab.wait_for_function("document.querySelector('.scenes canvas')")
        yield tab
        context.close()
        assert said == []  # nothing on the console, and nothing fetched

    return open_page


def _note_request(said: list[str], address: str) -> None:
    if not address.startswith(("file:", "data:")):
        said.append(address)


def status_of(tab: Tab) -> str:
    return tab.locator("p[role=status]").inner_text()


def clock_of(tab: Tab) -> float:
    return float(tab.locator(".bar .clock").inner_text().removesuffix(" s"))


def wait_for_clock(tab: Tab, condition: str) -> None:
    clock = "parseFloat(document.querySelector('.bar .clock').textContent)"
    tab.wait_for_function(f"{clock} {condition}")


def hash_of(tab: Tab) -> str:
    return tab.evaluate("location.hash")


def fly_fast(tab: Tab) -> None:
    tab.get_by_role("combobox", name="Speed").select_option("4")


def wait_until_over(tab: Tab) -> None:
    tab.get_by_role("button", name="Again", exact=True).wait_for()


def test_a_person_flies_an_episode_with_keys_and_it_is_kept(opened: Open):
    with opened() as tab:
        expect(tab.get_by_text("None yet.")).to_be_visible()
        fly_fast(tab)
        tab.keyboard.down("ArrowUp")
        tab.keyboard.down("ArrowLeft")
        wait_until_over(tab)
        assert " you −" in status_of(tab)
        kept = json.loads(tab.evaluate("localStorage.getItem('touchdown-best-flights')"))
        assert [flight["outcome"] for flight in kept] == ["out of bounds"]
        assert kept[0]["link"] == hash_of(tab).removeprefix("#")
        tab.reload()  # which shows the flight again, and does not keep it twice
        expect(tab.locator(".best tbody tr")).to_have_count(1)
        assert tab.locator(".best tbody td").nth(1).inner_text() == "out of bounds"
        tab.get_by_role("button", name="Clear").click()
        expect(tab.get_by_text("None yet.")).to_be_visible()


def test_the_shipped_policy_lands_and_wins_the_race(opened: Open):
    with opened() as tab:
        fly_fast(tab)
        tab.get_by_role("button", name="Watch ace").click()
        wait_until_over(tab)
        first, *others = status_of(tab).split(" · ")
        assert first == "1. ace +279.3 (landed)"
        assert sorted(each.split()[1] for each in others) == ["heuristic", "pid"]
        assert "by=ace&against=pid&against=heuristic" in hash_of(tab)
        assert "flight=" not in hash_of(tab)  # the autopilot's actions need not be told
        tab.get_by_role("button", name="Side by side").click()
        assert tab.locator(".scenes canvas").count() == 3


def test_the_map_of_a_random_policy_leaves_its_flight_alone(opened: Open, tmp_path: Path):
    path = tmp_path / "random.html"
    path.write_text(playground.render([playground.page_policy_of(lookup.load("random"))], seed=7))
    link = "start=7&by=random"
    request = {"module": encoded(MODULE), "ace": encoded(ACE)}
    (game,) = in_node(
        "games.js", "play", request | {"games": [{"link": link, "script": [["frames", 20]]}]}
    )
    (flight,) = game["flights"]
    with opened(f"#{link}", page=path.as_uri()) as tab:
        wait_until_over(tab)
        assert f"return −{-flight['returns'][-1]:.1f}" in status_of(tab)


def test_a_shared_link_repeats_the_flight_to_the_last_bit(opened: Open):
    rough = "#start=12&by=you&autopilot=ace&against=pid&wind=12&faults=0.1&noise=0.05"
    with opened(rough) as tab:
        tab.keyboard.down("KeyW")
        tab.wait_for_timeout(300)
        tab.keyboard.up("KeyW")
        tab.keyboard.press("t")  # the autopilot flies on
        fly_fast(tab)
        wait_until_over(tab)
        result, link = status_of(tab), hash_of(tab)
    assert "check=" in link
    with opened(link) as tab:
        fly_fast(tab)
        wait_until_over(tab)
        assert status_of(tab) == result
        assert hash_of(tab) == link  # its check is a digest of every bit of the last states
        assert tab.locator(".best tbody tr").count() == 0  # it is somebody else's
        assert tab.get_by_role("slider", name="Wind").get_attribute("aria-valuetext") == "12.0"


def test_a_flight_that_goes_differently_is_noted_unless_its_reader_takes_over(opened: Open):
    # main engine for 15 steps, nothing for 40, and the check of some other flight
    link = "#start=12&by=you&autopilot=ace&flight=ZJEC&check=other"
    with opened(link) as tab:
        fly_fast(tab)
        expect(tab.locator("p[role=status]")).to_contain_text("Your turn")
        tab.keyboard.down("ArrowLeft")
        wait_until_over(tab)
        tab.keyboard.up("ArrowLeft")
        assert not status_of(tab).endswith("This flight differs from the shared one.")
        whole = hash_of(tab)
        expect(tab.locator(".best tbody tr")).to_have_count(1)  # it is the reader's now
    with opened(whole.replace("check=", "check=other")) as tab:
        fly_fast(tab)
        wait_until_over(tab)
        assert status_of(tab).endswith("This flight differs from the shared one.")
        for keys in (["Space"], [",", "."]):  # it ends again
            for key in keys:
                tab.keyboard.press(key)
            wait_until_over(tab)
            assert status_of(tab).endswith("This flight differs from the shared one.")
        tab.keyboard.down("ArrowUp")  # nothing is left to fly
        assert tab.locator(".best tbody tr").count() == 0
        tab.keyboard.press("Space")
        wait_until_over(tab)
        assert tab.locator(".best tbody tr").count() == 0


def test_a_flight_pauses_steps_rewinds_and_goes_on(opened: Open):
    with opened("#start=7&by=ace") as tab:
        clock = tab.locator(".bar .clock")
        wait_for_clock(tab, "> 1.2")
        tab.keyboard.press("Space")
        expect(tab.get_by_role("button", name="Play")).to_be_visible()
        tab.wait_for_timeout(100)  # for a frame that was under way
        paused = clock_of(tab)
        tab.wait_for_timeout(100)
        assert clock_of(tab) == paused
        for key, after in ((".", 0.02), (",", 0), (",", -0.02), ("b", -1.02)):
            tab.keyboard.press(key)
            expect(clock).to_have_text(f"{paused + after:.2f} s")
        tab.get_by_role("slider", name="Time").fill("10")
        expect(clock).to_have_text("0.20 s")
        tab.keyboard.press("Space")
        wait_for_clock(tab, "> 0.3")
        tab.get_by_role("button", name="Start again").click()
        wait_for_clock(tab, "< 0.3")


def test_a_broken_link_is_explained_and_a_person_can_fly_anyway(opened: Open):
    with opened("#start=7&by=eagle") as tab:
        assert status_of(tab) == (
            "The link cannot be opened: this page has no policy eagle; add its weights to open it."
        )
        tab.keyboard.press("ArrowUp")
        assert status_of(tab) == "You are flying."
        tab.evaluate("location.hash = 'by=ace'")
        broken = "The link cannot be opened: it has no start."
        expect(tab.locator("p[role=status]")).to_have_text(broken)
        tab.keyboard.press("Space")  # pauses the flight under way
        assert status_of(tab) == broken


def test_a_link_waits_for_the_weights_of_its_policy(opened: Open, tmp_path: Path):
    for name in ("eagle", "hawk"):
        (tmp_path / f"{name}.safetensors").write_bytes(
            lookup.SHIPPED.joinpath("ace.safetensors").read_bytes()
        )
    with opened("#start=8&by=eagle&against=hawk") as tab:
        chooser = tab.get_by_label("Add a policy from a file of weights")
        chooser.set_input_files(tmp_path / "eagle.safetensors")
        expect(tab.locator("p[role=status]")).to_contain_text("this page has no policy hawk")
        chooser.set_input_files(tmp_path / "hawk.safetensors")
        expect(tab.get_by_role("radio", name="eagle")).to_be_checked()
        expect(tab.get_by_role("checkbox", name="hawk")).to_be_checked()
        expect(tab.get_by_role("spinbutton")).to_have_value("8")


def test_a_phone_is_held_with_two_thumbs(opened: Open):
    with opened(**PHONE, color_scheme="dark") as tab:
        assert tab.evaluate("document.documentElement.scrollWidth") == 390
        main = tab.get_by_role("button", name="Main engine").bounding_box()
        left = tab.get_by_role("button", name="Left engine").bounding_box()
        assert main["y"] > 700  # within reach of a thumb
        assert min(main["height"], left["height"], left["width"]) >= 44
        points = [
            {"x": box["x"] + 20, "y": box["y"] + 20, "id": number}
            for number, box in enumerate((main, left))
        ]
        touch = tab.context.new_cdp_session(tab)
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": points})
        wait_for_clock(tab, "> 0.3")
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        tab.get_by_role("button", name="Pause").tap()
        commands = tab.evaluate("""async () => {
            const { readLink } = await import("touchdown/play/link.js");
            return readLink(location.hash).commands;
        }""")
        assert commands[5:15] == [5] * 10  # both engines, in turns


def test_a_file_of_weights_becomes_a_rival_and_any_other_file_is_refused(
    opened: Open, tmp_path: Path
):
    (tmp_path / "mine.safetensors").write_bytes(
        lookup.SHIPPED.joinpath("ace.safetensors").read_bytes()
    )
    (tmp_path / "photo.safetensors").write_bytes(b"no weights at all")
    long = tmp_path / f"{'long' * 50}.safetensors"
    shutil.copy(tmp_path / "mine.safetensors", long)
    with opened("#start=7&by=pid") as tab:
        chooser = tab.get_by_label("Add a policy from a file of weights")
        chooser.set_input_files(tmp_path / "photo.safetensors")
        status = tab.locator("p[role=status]")
        expect(status).to_contain_text("photo.safetensors: not a safetensors file: ")
        chooser.set_input_files(tmp_path / "mine.safetensors")
        expect(tab.get_by_role("checkbox", name="mine")).to_be_checked()
        fly_fast(tab)
        wait_until_over(tab)
        assert status_of(tab).startswith("1. mine +279.3 (landed)")
        tab.get_by_role("radio", name="mine").check()
        expect(tab.get_by_role("heading", name="What mine expects")).to_be_visible()
        chooser.set_input_files(tmp_path / "mine.safetensors")
        expect(tab.get_by_role("checkbox", name="mine-2")).to_be_checked()
        chooser.set_input_files(long)
        tab.get_by_role("radio", name="long").check()
        for width in (390, 1280):
            tab.set_viewport_size({"width": width, "height": 800})
            assert tab.evaluate("document.documentElement.scrollWidth") == width


def test_a_gamepad_flies(opened: Open):
    pad = """navigator.getGamepads = () => [window.pad ?? null];"""
    with opened(script=pad) as tab:
        buttons = "Array.from({ length: 16 }, (_, i) => ({ pressed: i === 0 }))"
        tab.evaluate(f"window.pad = {{ index: 0, axes: [0.9, 0], buttons: {buttons} }}")
        wait_for_clock(tab, "> 0.2")
        tab.evaluate("window.pad = null")
        assert status_of(tab) == "You are flying."


def test_a_browser_that_keeps_nothing_still_plays(opened: Open):
    forbidden = """Object.defineProperty(window, "localStorage", {
        get() { throw new DOMException("forbidden", "SecurityError"); } });
        history.replaceState = () => { throw new DOMException("forbidden", "SecurityError"); };"""
    with opened("#start=7&by=you&autopilot=pid", script=forbidden) as tab:
        fly_fast(tab)
        tab.keyboard.down("ArrowRight")
        wait_until_over(tab)
        expect(tab.locator(".best tbody tr")).to_have_count(1)


def test_flights_are_shown_at_once_unless_less_motion_is_wanted(opened: Open):
    with opened(reduced_motion="no-preference") as tab:
        wait_for_clock(tab, "> 0.1")
        expect(tab.get_by_text("to fly").first).to_be_visible()
        tab.get_by_role("button", name="Fly", exact=True).click()
        assert status_of(tab) == "Ready: press an engine to begin."
        expect(tab.get_by_role("radio", name="you")).to_be_checked()
    with opened() as tab:
        tab.wait_for_timeout(200)
        assert clock_of(tab) == 0


def test_the_keyboard_reaches_everything_in_a_sensible_order(opened: Open):
    with opened() as tab:
        order = []
        for _ in range(40):
            tab.keyboard.press("Tab")
            order.append(
                tab.evaluate("""() => {
                const each = document.activeElement;
                return each.ariaLabel || each.name || each.textContent.trim();
            }""")
            )
        assert order[:13] == [
            *("Share", "Switch between light and dark", "Fly", "Watch ace", "Start again"),
            *("One second back", "One step back", "Play", "One step forward", "Time", "Speed"),
            *("Autopilot", "by"),
        ]
        for name in (
            "rival",
            "Side by side",
            "Seed of the start",
            "gravity",
            "noise",
            "map",
            "Keys",
        ):
            assert name in order
        # a radio button that a keyboard has reached turns by arrows, and no engine fires
        tab.get_by_role("radio", name="ace").focus()
        tab.keyboard.press("ArrowRight")
        expect(tab.get_by_role("radio", name="pid")).to_be_checked()
        assert "by=pid" in hash_of(tab) or status_of(tab).startswith("pid is flying")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_stand_out_and_the_scene_fits_the_window(opened: Open, scheme: str):
    look = """() => [...document.querySelectorAll("h1, h1 span, h2, legend, button, .chip span, "
        + ".clock, .amount, figcaption span, .value b, .none, summary, [role=status]")].filter(
          (each) => each.checkVisibility() && !each.closest(".chip:has(:disabled)")).map((each) => {
      let behind = each;
      while (getComputedStyle(behind).backgroundColor === "rgba(0, 0, 0, 0)")
        behind = behind.parentElement;
      return [each.textContent, getComputedStyle(each).color,
              getComputedStyle(behind).backgroundColor];
    })"""
    with opened("#start=7&by=ace&against=pid", color_scheme=scheme) as tab:
        wait = "() => document.querySelector('[data-value]').textContent !== ''"
        tab.wait_for_function(wait)
        found = tab.evaluate(look)
        assert len(found) > 30
        assert [each for each in found if contrast(*each[1:]) < 4.5] == []  # WCAG 2.2, 1.4.3
        assert tab.evaluate("document.documentElement.scrollWidth") == 1280
        bar = tab.locator(".bar").bounding_box()
        assert bar["y"] + bar["height"] <= 800  # scene and controls, without scrolling


def test_values_are_shown_in_return_points(opened: Open):
    observation, _ = LanderEnv().reset(seed=7)
    ace = lookup.load("ace")
    assert ace.reward_scale == 0.1
    expected = ace.policy.values(observation[None])[0] / 0.1  # type: ignore[attr-defined]
    with opened() as tab:
        shown = tab.locator("[data-strip=values] b")
        expect(shown.first).not_to_be_empty()
        values = [float(each.replace("−", "-")) for each in shown.all_inner_texts()]
        assert values == pytest.approx(expected, abs=0.051)


def test_strips_and_map_show_what_the_network_thinks(opened: Open):
    with opened("#start=7&by=ace&against=pid") as tab:
        fly_fast(tab)
        wait_until_over(tab)
        tab.wait_for_timeout(300)
        values = [float(b.inner_text().replace("−", "-")) for b in
                  tab.locator("[data-strip=values] b").all()]  # fmt: skip
        best, second = sorted(values, reverse=True)[:2]
        gap = float(tab.locator("[data-strip=gap] b").inner_text())
        assert gap == pytest.approx(best - second, abs=0.11)  # values are shown to 0.1
        colours = """(canvas) => {
            const { width, height } = canvas;
            const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
            const seen = new Set();
            for (let i = 0; i < data.length; i += 4) seen.add(data.slice(i, i + 3).join());
            return seen.size;
        }"""
        assert tab.locator(".plot canvas").evaluate(colours) >= 4  # actions, path and cross
        for name in ("values", "gap", "actions", "fuel", "return"):
            assert tab.locator(f"[data-strip={name}] canvas").evaluate(colours) >= 2, name
