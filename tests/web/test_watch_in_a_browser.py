"""Training as people watch it: in Chromium, live and from disk."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from playwright.sync_api import Browser, expect
from playwright.sync_api import Page as Tab

from chromium import chromium
from contrast import contrast
from touchdown.agents.learners.backend import is_built
from touchdown.api.watching import index_of, watch
from touchdown.runs.folder import RunFolder
from touchdown.web.watch.run_index import key_of
from watched_runs import Servers, append, episode, new_run

SIZES = {"desktop": (1280, 800), "phone": (390, 844)}
SETTINGS = (
    "--hidden-sizes=16",
    "--max-env-steps=8000",
    "--validation-period=2000",
    "--validation-episodes=2",
    "--final-validation-episodes=2",
    "--test-episodes=0",
)
PATIENCE = 60_000  # milliseconds, on a busy machine
pytestmark = pytest.mark.skipif(not is_built(), reason="the kernel was not built")


class Watched(NamedTuple):
    """A run that was watched from its first episode to its end."""

    folder: RunFolder
    counts: list[int]
    """Episodes that the page showed, in order."""
    said: list[str]
    """On the browser's console."""


@pytest.fixture(scope="module")
def browser() -> Generator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def watched(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Watched:
    """Train a run with `--watch`, with its page open, which is closed at the end."""
    folder = RunFolder(tmp_path_factory.mktemp("watched") / "runs" / "live")
    command = [sys.executable, "-m", "touchdown", "train", "pilot", "--name=live", "--watch"]
    command += [f"--runs-dir={folder.path.parent}", *SETTINGS]
    no_display = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    counts: list[int] = []
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=no_display
    ) as training:
        assert training.stdout is not None
        address = training.stdout.readline().removeprefix("watch: ").strip()
        training.send_signal(signal.SIGSTOP)  # a busy machine opens the page after its end
        with opened(browser, address, allowed="http://127.0.0.1:") as (tab, said):
            shown = tab.locator(".run dl div", has_text=re.compile("^episodes")).locator("dd")
            expect(shown).not_to_be_empty(timeout=PATIENCE)
            training.send_signal(signal.SIGCONT)
            while len(rows(folder)) < 3:
                time.sleep(0.005)
            training.send_signal(signal.SIGSTOP)  # and looks at it after its end
            expect(shown).to_have_text(re.compile(r"^[1-9]\d*$"), timeout=PATIENCE)
            counts.append(int(shown.inner_text()))
            training.send_signal(signal.SIGCONT)
            while tab.locator(".badge.finished").count() == 0:
                counts.append(int(shown.inner_text()))
                assert training.poll() in (None, 0), training.communicate()
                time.sleep(0.1)
            training.communicate(timeout=60)
            counts.append(int(shown.inner_text()))
            tab.reload()  # the page survives the end of training
            expect(tab.locator(".badge.finished")).to_be_visible(timeout=PATIENCE)
    port = int(re.findall(r":(\d+)/", address)[0])
    deadline = time.monotonic() + 30
    while is_open(port):  # the server ends with the page
        assert time.monotonic() < deadline
        time.sleep(0.2)
    return Watched(folder, counts, said)


def is_open(port: int) -> bool:
    with socket.socket() as trying:
        return trying.connect_ex(("127.0.0.1", port)) == 0


@contextmanager
def opened(
    browser: Browser, address: str, allowed: str = "file:", size: str = "desktop", **settings: Any
) -> Iterator[tuple[Tab, list[str]]]:
    """A tab, and what its console says; all requests must begin with `allowed`."""
    width, height = SIZES[size]
    context = browser.new_context(viewport={"width": width, "height": height}, **settings)
    tab = context.new_page()
    said: list[str] = []
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("request", lambda request: check_request(said, request.url, allowed))
    tab.goto(address)
    yield tab, said
    context.close()


def check_request(said: list[str], url: str, allowed: str) -> None:
    if not url.startswith((allowed, "data:", "blob:")):
        said.append(url)


@pytest.fixture(scope="module")
def page(browser: Browser, watched: Watched) -> Generator[tuple[Tab, list[str]]]:
    """The page of the run as one file, opened from disk."""
    out = watched.folder.path.parent.parent / "page.html"
    watch("live", runs_dir=watched.folder.path.parent, out=out)
    with opened(browser, out.as_uri()) as (tab, said):
        expect(tab.locator("#flight-said")).to_contain_text("Greedy flight", timeout=PATIENCE)
        yield tab, said


def rows(folder: RunFolder) -> list[dict[str, Any]]:
    written = folder.episodes.read_text() if folder.episodes.is_file() else ""
    return [json.loads(line) for line in written.splitlines(keepends=True) if line.endswith("\n")]


def test_a_run_is_watched_from_its_first_episodes_to_its_end(watched: Watched):
    recorded = rows(watched.folder)
    assert watched.counts == sorted(watched.counts)
    assert watched.counts[-1] == recorded[-1]["episode"]
    assert watched.counts[0] < watched.counts[-1]
    assert watched.said == []


def click_an_episode(tab: Tab) -> int:
    """Click a point of the learning curve; the number of the episode that flies."""
    points = tab.locator("#curve .points path")
    expect(points.first).to_be_visible(timeout=PATIENCE)
    caption = tab.locator("#flight-said")
    until = time.monotonic() + PATIENCE / 1_000
    number = points.count() // 2
    # a chart that is drawn anew between the move and the click has no point under the pointer
    while "Training episode" not in caption.inner_text():
        assert time.monotonic() < until
        box = points.nth(number).bounding_box()
        assert box is not None
        tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=4)
        tab.wait_for_timeout(200)
        tab.mouse.down()
        tab.mouse.up()
        tab.wait_for_timeout(1_000)
        number = (number + 1) % points.count()
    found = re.search(r"Training episode ([\d,]+)", caption.inner_text())
    assert found
    return int(found[1].replace(",", ""))


def test_a_click_on_a_point_flies_that_episode_as_it_was(watched: Watched, page):
    tab, said = page
    number = click_an_episode(tab)
    (row,) = [row for row in rows(watched.folder) if row["episode"] == number]
    flown = float(tab.locator("#flight-said").get_attribute("data-return") or "nan")
    assert flown == row["episode_return"]
    text = tab.locator("#flight-said").inner_text()
    assert f"{row['outcome']}, " in text
    assert f"{row['steps']} steps" in text
    tab.get_by_role("button", name="Back to the film of learning").click()
    expect(tab.locator("#flight-said")).to_contain_text("Greedy flight", timeout=PATIENCE)
    assert said == []


def test_the_slider_goes_through_the_policies_of_training(watched: Watched, page):
    tab, said = page
    saved = sorted(path.stem for path in watched.folder.over_training.iterdir())
    slider = tab.locator("#policy")
    assert slider.get_attribute("max") == str(len(saved) - 1)
    assert f"after {int(saved[-1]):,} steps" in tab.locator("#policy-said").inner_text()
    slider.focus()
    tab.keyboard.press("Home")
    expect(tab.locator("#policy-said")).to_contain_text("before training")
    expect(tab.locator(".starts button").first).not_to_have_text("…", timeout=PATIENCE)
    tab.locator(".starts button").nth(1).click()
    expect(tab.locator("#flight-said")).to_contain_text("start 1000001", timeout=PATIENCE)
    expect(tab.locator(".starts button").nth(1)).to_be_focused()
    mark = tab.locator(".marks button").locator("visible=true").first
    expect(mark).to_be_visible(timeout=PATIENCE)
    mark.click()
    expect(tab.locator("#network-said")).to_contain_text("dead units")
    assert painted(tab, "#network")
    assert painted(tab, ".scene")
    assert said == []


def painted(tab: Tab, canvas: str) -> bool:
    """Whether a canvas has more than one colour."""
    return tab.locator(canvas).evaluate("""(canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      return data.some((value, place) => value !== data[place % 4]);
    }""")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES)
def test_the_page_from_disk_fits_the_window_and_is_readable(page, size: str, scheme: Any):
    tab, said = page
    width, height = SIZES[size]
    tab.set_viewport_size({"width": width, "height": height})
    tab.emulate_media(color_scheme=scheme)
    tab.wait_for_function(f"document.querySelector('#curve .main-svg').clientWidth < {width}")
    assert tab.evaluate("document.documentElement.scrollWidth") == width
    for chart in ("curve", "loss", "outcomes", "q", "epsilon", "along", "over"):
        assert tab.locator(f"#{chart} .main-svg").first.bounding_box()["height"] > 150
    for part in (".note", ".badge", ".brand", ".run dt", "h2"):
        assert contrast(*colours_of(tab, part)) > 4.5, part  # WCAG 2.2, 1.4.3
    assert tab.locator("#connection").inner_text() == "saved copy"
    assert not tab.locator("#all-runs").is_visible()
    assert said == []


def colours_of(tab: Tab, selector: str) -> tuple[str, str]:
    """The colours of the first such text that is visible and of what is behind it."""
    # looked up in the page, which may replace an element at any time
    found = """(selector) => {
      const found = [...document.querySelectorAll(selector)];
      const element = found.find((each) => each.checkVisibility());
      let behind = element;
      while (getComputedStyle(behind).backgroundColor === "rgba(0, 0, 0, 0)")
        behind = behind.parentElement;
      return [getComputedStyle(element).color, getComputedStyle(behind).backgroundColor];
    }"""
    ink, behind = tab.evaluate(found, selector)
    return ink, behind


def test_runs_are_chosen_from_the_list_and_seen_side_by_side(
    browser: Browser, watched: Watched, servers: Servers
):
    other = new_run(watched.folder.path.parent, "other")
    append(other.episodes, *(episode(number) for number in range(1, 9)))
    address = serving(servers, watched.folder.path.parent)
    with opened(browser, address, allowed=address) as (tab, said):
        expect(tab.locator("#list a")).to_have_text(["other", "live"])
        tab.get_by_role("checkbox", name="choose live").check()
        tab.get_by_role("checkbox", name="choose other").check()
        os.utime(other.episodes, (0, 0))
        expect(tab.locator("#list a")).to_have_text(["live", "other"], timeout=PATIENCE)
        expect(tab.get_by_role("checkbox", name="choose other")).to_be_focused()
        tab.get_by_role("button", name="Watch").click()
        expect(tab.locator(".run")).to_have_count(2, timeout=PATIENCE)
        expect(tab.locator("#curve .scatterlayer .trace")).to_have_count(3, timeout=PATIENCE)
        assert tab.locator("#which").is_hidden()  # only one of them can be flown
        append(other.episodes, episode(9))
        card = tab.locator(".run", has_text="other")
        expect(card.locator("dd").nth(2)).to_have_text("9", timeout=PATIENCE)
        assert said == []


@pytest.fixture
def twins(watched: Watched, tmp_path: Path) -> list[RunFolder]:
    """Two copies of the run that was watched."""
    found = [RunFolder(tmp_path / "runs" / name) for name in ("one", "two")]
    for each in found:
        shutil.copytree(watched.folder.path, each.path)
    return found


def test_another_run_is_chosen_to_fly(browser: Browser, twins: list[RunFolder], servers: Servers):
    address = serving(servers, twins[0].path.parent)
    query = "&".join(f"run={key_of(each)}" for each in twins)
    with opened(browser, f"{address}?{query}", allowed=address) as (tab, said):
        caption, slider = tab.locator("#flight-said"), tab.locator("#policy-said")
        expect(caption).to_contain_text("Greedy flight", timeout=PATIENCE)
        for name in ("two", "one", "two"):
            tab.get_by_label("Run to fly").select_option(name)
            expect(tab.locator(".film-stage canvas")).to_have_count(1)
            tab.locator("#policy").focus()
            tab.keyboard.press("Home")
            expect(slider).to_contain_text("before training, 1 of")
            tab.get_by_role("button", name="Play the film of learning").click()
            tab.get_by_role("button", name="Stop the film").click()  # one listener, not two
        assert painted(tab, "#network")
        assert said == []


def test_policies_that_training_deletes_leave_the_chosen_one_where_it_is(
    browser: Browser, twins: list[RunFolder], servers: Servers
):
    run, _ = twins
    address = serving(servers, run.path.parent)
    first, second, *_ = sorted(run.over_training.iterdir())
    with opened(browser, f"{address}?run={key_of(run)}", allowed=address) as (tab, said):
        policy = tab.locator("#policy-said")
        expect(tab.locator("#flight-said")).to_contain_text("Greedy flight", timeout=PATIENCE)
        tab.locator("#policy").focus()
        tab.keyboard.press("Home")
        tab.keyboard.press("ArrowRight")
        chosen = f"after {int(second.stem):,} steps"
        expect(policy).to_contain_text(f"{chosen}, 2 of")
        first.unlink()
        expect(policy).to_contain_text(f"{chosen}, 1 of", timeout=PATIENCE)
        assert tab.locator("#policy").input_value() == "0"
        assert said == []


def test_a_hostile_name_is_text_and_nothing_else(
    browser: Browser, tmp_path: Path, servers: Servers
):
    hostile = '<img src=x onerror=alert(1)><a href="javascript:alert(1)">\u202ex'
    folder = new_run(tmp_path / "runs", "plain")
    append(folder.episodes, *(episode(number) for number in range(1, 5)))
    renamed = RunFolder(folder.path.rename(folder.path.with_name(hostile)))
    shown = hostile.replace("\u202e", "\ufffd")
    address = serving(servers, tmp_path / "runs")
    with opened(browser, address, allowed=address) as (tab, said):
        tab.on("dialog", lambda dialog: said.append(dialog.message))
        expect(tab.get_by_role("link", name=shown, exact=True)).to_be_visible()
        tab.goto(f"{address}?run={key_of(renamed)}")
        expect(tab.locator(".run strong")).to_have_text(shown, timeout=PATIENCE)
        assert tab.locator("main img, main a[href^=javascript]").count() == 0
        assert said == []


def test_other_environments_have_charts_and_no_flights(
    browser: Browser, tmp_path: Path, servers: Servers
):
    cart = new_run(tmp_path / "runs", "cart", "CartPole-v1")
    append(cart.episodes, *(episode(number, outcome="terminated") for number in range(1, 30)))
    empty = new_run(tmp_path / "runs", "empty")
    address = serving(servers, tmp_path / "runs")
    with opened(browser, f"{address}?run={key_of(cart)}", allowed=address) as (tab, said):
        expect(tab.locator("#curve .points path").first).to_be_visible(timeout=PATIENCE)
        assert tab.locator("#flight").is_hidden()
        tab.goto(f"{address}?run={key_of(empty)}")
        expect(tab.locator(".run dd")).to_have_text("none yet", timeout=PATIENCE)
        tab.goto(f"{address}?run={'0' * 16}")
        expect(tab.locator(".notice")).to_contain_text(
            "This run no longer exists", timeout=PATIENCE
        )
        assert said == []


def test_the_page_says_when_its_server_is_gone(browser: Browser, tmp_path: Path, servers: Servers):
    run = new_run(tmp_path / "runs", "alone")
    append(run.episodes, episode(1))
    address = serving(servers, tmp_path / "runs")
    with opened(browser, f"{address}?run={key_of(run)}", allowed=address) as (tab, _):
        expect(tab.locator(".run strong")).to_have_text("alone", timeout=PATIENCE)
        servers.end()
        expect(tab.locator("#connection")).to_contain_text("no connection", timeout=PATIENCE)
        assert tab.locator(".run strong").inner_text() == "alone"


@pytest.fixture
def servers() -> Generator[Servers]:
    """Servers, which end with the test."""
    found = Servers()
    yield found
    found.end()


def serving(servers: Servers, runs: Path) -> str:
    """The address of a server of a folder."""
    return servers.start(index_of(runs)).address
