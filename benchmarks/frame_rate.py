"""Frames per second of the playground in Chromium, and what a frame costs its script.

Four landers fly on one page, as ghosts and side by side: the shipped policy, the PID controller,
the heuristic and random actions. A headless browser without a graphics card draws in software, so a
laptop is faster; `slowed` lets the processor of the page run at a quarter of its speed.

    python benchmarks/frame_rate.py --seconds 10
"""

import argparse
import os
import shutil
import statistics
import tempfile
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

import touchdown
from touchdown.core import threads
from touchdown.runs.provenance import cpu_name

LINK = "#start=7&by=ace&against=pid&against=heuristic&against=random&gravity=1"
DESK = {"viewport": {"width": 1280, "height": 800}}
PHONE = {"viewport": {"width": 390, "height": 844}, "device_scale_factor": 3, "is_mobile": True}
NOTE_FRAMES = """
const ask = requestAnimationFrame;
window.requestAnimationFrame = (draw) => ask((now) => {
  const begin = performance.now();
  draw(now);
  window.noted.push([now, performance.now() - begin]);
});
window.noted = [];
"""


def frames_of(
    browser: Browser,
    page: Path,
    *,
    window: Mapping[str, object],
    slowdown: int,
    apart: bool,
    seconds: float,
) -> list[tuple[float, float]]:
    """The time of each frame while four landers fly, and how long its script took, in ms."""
    context = browser.new_context(**window)  # pyright: ignore[reportArgumentType]
    context.add_init_script(NOTE_FRAMES)
    tab = context.new_page()
    tab.goto(page.absolute().as_uri() + LINK)
    if apart:
        tab.get_by_role("button", name="Side by side").click()
    context.new_cdp_session(tab).send("Emulation.setCPUThrottlingRate", {"rate": slowdown})
    tab.wait_for_timeout(1_000)
    tab.evaluate("window.noted.length = 0")
    tab.wait_for_timeout(1_000 * seconds)
    frames = tab.evaluate("window.noted")
    if tab.locator(".after").is_visible():
        raise SystemExit("the landers had landed before the end: give fewer --seconds")
    context.close()
    return frames


def main() -> None:
    """Fly on each page and print its frames."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10)
    args = parser.parse_args()
    path = shutil.which("chromium") or shutil.which("google-chrome")
    flags = ["--no-sandbox"] if os.geteuid() == 0 else []
    print(f"{cpu_name()}, {threads.available()} cores, no graphics card")
    print("page                      frames/s   script, ms: median, 99%   longest gap, ms")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        page = touchdown.play("random", out=Path(folder) / "page.html", browser=False)
        browser = playwright.chromium.launch(executable_path=path, args=flags)
        for name, window, slowdown, apart in (
            ("desktop, ghosts", DESK, 1, False),
            ("desktop, side by side", DESK, 1, True),
            ("phone, ghosts", PHONE, 1, False),
            ("phone, ghosts, slowed", PHONE, 4, False),
        ):
            frames = frames_of(
                browser, page, window=window, slowdown=slowdown, apart=apart, seconds=args.seconds
            )
            at, script = zip(*frames, strict=True)
            gaps = [after - before for before, after in pairwise(at)]
            rate = 1_000 * len(gaps) / (at[-1] - at[0])
            slowest = statistics.quantiles(script, n=100)[-1]
            print(
                f"{name:24} {rate:9.1f}   {statistics.median(script):18.1f} {slowest:5.1f}"
                f"   {max(gaps):15.1f}"
            )
        browser.close()


if __name__ == "__main__":
    main()
