"""The browser that the machine has, for tests of pages."""

import os
import shutil
from collections.abc import Generator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Browser, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome")
# a root of a container has no sandbox, and nothing here is to reach the network
FLAGS = ["--disable-gpu", "--disable-background-networking", "--disable-component-update"]


@contextmanager
def chromium() -> Generator[Browser]:
    """Chromium, closed at the end; without one the test is skipped."""
    path = next((found for name in NAMES if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip(f"no browser on PATH: looked for {', '.join(NAMES)}")
    flags = [*FLAGS, "--no-sandbox"] if os.geteuid() == 0 else FLAGS
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=flags)
        yield browser
        browser.close()
