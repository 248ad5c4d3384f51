"""Flights on the engine in a browser have the bits of those on the native engine."""

from base64 import b64decode, b64encode
from collections.abc import Generator
from typing import Any

import pytest
from compare_flights import FLIGHTS, compare, jobs, request
from javascript import in_browser, in_node
from playwright.sync_api import Browser

from chromium import chromium


@pytest.fixture(scope="module")
def browser() -> Generator[Browser]:
    with chromium() as found:
        yield found


def check(answer: dict[str, Any], flown: list[dict[str, Any]]) -> None:
    compared = compare(answer, flown)
    assert compared.differing == []
    assert compared.outcomes == {"landed", "crashed", "out of bounds", "timed out"}


def test_flights_in_node_are_the_native_engines():
    flown = jobs(200)
    check(in_node(FLIGHTS, "answer", request(flown)), flown)


def test_flights_in_a_browser_are_the_native_engines(browser: Browser):
    flown = jobs(60)
    check(in_browser(browser, FLIGHTS, "answer", request(flown)), flown)


@pytest.mark.slow
def test_a_thousand_flights_in_a_browser_are_the_native_engines(browser: Browser):
    flown = jobs(1000)
    check(in_browser(browser, FLIGHTS, "answer", request(flown)), flown)


def test_a_flight_that_differs_in_one_bit_is_found():
    flown = jobs(4)
    answer = in_node(FLIGHTS, "answer", request(flown))
    episode = answer["episodes"][2]
    changed = bytearray(b64decode(episode["rewards"]))
    changed[40] ^= 1
    episode["rewards"] = b64encode(changed).decode()
    assert compare(answer, flown).differing == [flown[2]]
