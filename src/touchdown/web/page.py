"""A page from a template, its modules and its data: one file, or one that a server completes."""

import json
import re
from base64 import b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

ENGINE = "lander.wasm"
"""The engine, among the static files and the files of a page."""
_STATIC = Path(__file__).with_name("static")
_SCRIPT = "text/javascript"
_NAMED = re.compile(r'"touchdown/([\w/-]+\.js)"')


def module_names() -> list[str]:
    """Our JavaScript modules, such as `engine/lander.js`, sorted."""
    return sorted(path.relative_to(_STATIC).as_posix() for path in _STATIC.rglob("*.js"))


def static_file(name: str) -> bytes:
    """The content of a file that the pages need, such as `lander.wasm` or a module.

    Raises:
        FileNotFoundError: there is no such file.
    """
    return (_STATIC / name).read_bytes()


def render(
    template: str,
    *,
    title: str,
    data: Mapping[str, Any],
    binaries: Mapping[str, bytes],
    modules_at: str | None = None,
    script: str = "",
) -> str:
    """A page as HTML.

    Its modules import each other as `touchdown/FOLDER/NAME.js`. They read `data` and `binaries`
    with `touchdown/common/data.js`.

    Args:
        template: file name of the template.
        title: title of the page.
        data: what the page knows from the start, as JSON.
        binaries: files that the page needs, such as weights, by name.
        modules_at: relative URL of the folder with the modules, such as `./static/`. None puts
            those that the template needs into the page, which then opens from disk.
        script: library that the template puts into the page.

    Raises:
        ValueError: the library would end the script element in which it stands.
    """
    if "</script" in script.lower():
        raise ValueError("script: must not contain </script")
    environment = Environment(
        loader=ChoiceLoader(
            [
                PackageLoader("touchdown.web", "templates"),
                PackageLoader("touchdown.web", "static"),
                PackageLoader("touchdown.figures", "."),
            ]
        ),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    if modules_at:
        imports = {f"touchdown/{name}": f"{modules_at}{name}" for name in module_names()}
    else:
        text, *_ = PackageLoader("touchdown.web", "templates").get_source(environment, template)
        imports = {f"touchdown/{name}": _data_url(name) for name in sorted(_needed_by(text))}
    encoded = {name: b64encode(content).decode() for name, content in binaries.items()}
    return environment.get_template(template).render(
        title=title,
        import_map=_json({"imports": imports}),
        data=_json(data),
        binaries=_json(encoded),
        script=Markup(script),  # noqa: S704 - ends no element
    )


def _needed_by(text: str) -> set[str]:
    """The modules that a script names, those that these name, and so on."""
    needed = set[str]()
    named = set(_NAMED.findall(text))
    while named - needed:
        name = (named - needed).pop()
        needed.add(name)
        named |= set(_NAMED.findall(static_file(name).decode()))
    return needed


def _data_url(module: str) -> str:
    return f"data:{_SCRIPT};base64,{b64encode(static_file(module)).decode()}"


def _json(value: Any) -> Markup:
    """JSON that cannot end the script element in which it stands."""
    text = json.dumps(value, ensure_ascii=True, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)  # noqa: S704 - has no markup left
