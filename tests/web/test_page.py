import json
import re

from touchdown.web import page

HOSTILE = "</script><script>alert(1)</script>&<!--"


def rendered(**settings: object) -> str:
    values: dict[str, object] = {"title": HOSTILE, "data": {"name": HOSTILE}, "binaries": {}}
    return page.render("base.html.j2", **(values | settings))  # type: ignore[arg-type]


def json_of(text: str, element: str) -> object:
    found = re.search(rf"<script [^>]*{element}[^>]*>(.*?)</script>", text, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_names_cannot_leave_their_place_in_the_page() -> None:
    text = rendered()
    assert "<script>alert" not in text
    assert json_of(text, 'id="data"') == {"name": HOSTILE}


def test_a_page_from_disk_contains_its_modules_and_files() -> None:
    text = page.render("play.html.j2", title="x", data={}, binaries={"weights": b"\x00\xff"})
    imports = json_of(text, "importmap")["imports"]  # type: ignore[index]
    used = {"play/play.js", "scene/moon.js", "engine/lander.js", "common/data.js"}
    assert {f"touchdown/{name}" for name in used} <= set(imports)
    assert "touchdown/watch/watch.js" not in imports  # another page's
    assert all(url.startswith("data:text/javascript;base64,") for url in imports.values())
    assert json_of(text, 'id="binaries"') == {"weights": "AP8="}


def test_a_served_page_loads_its_modules_from_the_server() -> None:
    imports = json_of(rendered(modules_at="./static/"), "importmap")["imports"]  # type: ignore[index]
    assert imports["touchdown/common/data.js"] == "./static/common/data.js"
