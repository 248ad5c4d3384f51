import stat
import sys
import webbrowser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from touchdown.core.browser import has_display, open_page

ADDRESS = "http://127.0.0.1:8000/secret/?run=a&run=b"


@pytest.fixture
def opened(monkeypatch):
    found = []
    monkeypatch.setattr(webbrowser, "open", found.append)
    monkeypatch.setenv("DISPLAY", ":0")
    return found


def test_the_secret_is_in_a_private_file_and_not_in_the_command(opened):
    with open_page(ADDRESS):
        (url,) = opened
        assert "secret" not in url
        path = Path(unquote(urlsplit(url).path))
        assert 'href="http://127.0.0.1:8000/secret/?run=a&amp;run=b"' in path.read_text()
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert not path.exists()


def test_nothing_is_opened_without_a_display_or_an_address(opened, monkeypatch):
    with open_page(None):
        pass
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert not has_display()
    with open_page(ADDRESS):
        pass
    assert opened == []
