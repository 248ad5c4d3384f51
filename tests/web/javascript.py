"""Functions of JavaScript modules, called in Node or in a browser."""

import base64
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

STATIC = Path(__file__).parents[2] / "src/touchdown/web/static"
HERE = Path(__file__).parent


def in_node(module: Path, function: str, request: Any) -> Any:
    """What a module's function answers in Node; without Node the test is skipped."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node on PATH")
    done = subprocess.run(
        [node, "--no-warnings", str(HERE / "node.mjs"), str(module), function],
        input=json.dumps(request),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def in_browser(browser: Browser, module: Path, function: str, request: Any) -> Any:
    """What it answers on a page that has our modules in an import map."""
    imports = {f"touchdown/{path.name}": _data_url(path) for path in sorted(STATIC.glob("*.js"))}
    imports["the-test"] = _data_url(module)
    page = f'<script type="importmap">{json.dumps({"imports": imports})}</script>'
    tab = browser.new_page()
    tab.set_content(page)
    call = "async ([name, request]) => (await import('the-test'))[name](request)"
    answer = tab.evaluate(call, [function, request])
    tab.close()
    return answer


def _data_url(path: Path) -> str:
    return "data:text/javascript;base64," + base64.b64encode(path.read_bytes()).decode()
