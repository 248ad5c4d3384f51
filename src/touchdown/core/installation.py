"""How touchdown was installed, and the commands that complete this installation."""

import json
import shlex
import shutil
import sys
from collections.abc import Iterable
from functools import cache
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, get_args
from urllib.parse import unquote, urlparse

from touchdown.core.errors import UserError
from touchdown.core.version import __version__

DISTRIBUTION = "touchdown-rl"
"""Name to install; `touchdown` on PyPI is another project."""

Extra = Literal["mlflow", "onnx", "optuna", "ray", "wandb"]
EXTRAS: tuple[Extra, ...] = get_args(Extra)


def missing(where: str, library: str, extra: Extra, otherwise: str = "") -> UserError:
    """The error for a library that is not installed.

    Args:
        where: what needs it: a field and its value, or a verb.
        library: its name.
        extra: the extra of touchdown that contains it.
        otherwise: what to do without it; "" if there is nothing.
    """
    instead = f"{otherwise}, or " if otherwise else ""
    return UserError(
        f"{where}: needs {library}, which is not installed; {instead}install it: "
        f"{command_for(extra)}"
    )


def command_for(extra: Extra) -> str:
    """The shell command that adds an extra to this installation, such as `onnx`.

    It names the source that touchdown came from: an index, a clone, a wheel or a repository. If
    that source is gone, it names the libraries of the extra.
    """
    return f"{_installer()} {_with_extra(extra)}"


def how_to_compile() -> str:
    """What to do if the C++ modules were not compiled because there was no compiler."""
    return f"install a C++ compiler such as g++, then run: {command_to_rebuild()}"


def command_to_repair() -> str:
    """The shell command that installs the libraries of touchdown that are missing."""
    return f"{_installer()} {_source() or DISTRIBUTION}"


def command_to_rebuild() -> str:
    """The shell command that installs touchdown again, so that it compiles its C++ modules."""
    source = _source()
    if source is None:  # what it was installed from is gone, and an index has compiled wheels
        source = DISTRIBUTION
    # an installer would otherwise take the wheel that it built without a compiler from its cache
    fresh = "--reinstall --no-cache" if _uses_uv() else "--force-reinstall --no-cache-dir"
    return f"{_installer()} {fresh} --no-deps {source}"


def versions(packages: Iterable[str]) -> dict[str, str]:
    """The versions of touchdown and of the packages that are installed, by name."""
    return {"touchdown": __version__} | {
        name: distribution(name).version for name in packages if _is_present(name)
    }


def is_installed(extra: Extra) -> bool:
    """Whether the libraries of an extra are installed, in any version."""
    names = _names_of(extra)
    return bool(names) and all(map(_is_present, names))


def _with_extra(extra: str) -> str:
    source = _source(extra)
    if source is None:
        return " ".join(map(shlex.quote, _requirements(extra)))
    return source


def _source(extra: str | None = None) -> str | None:
    """What to install, quoted for a shell; None if it no longer exists.

    `direct_url.json` is specified by PEP 610; an installation from an index has none.
    """
    named = f"{DISTRIBUTION}[{extra}]" if extra else DISTRIBUTION
    origin = _origin()
    if origin is None:
        return shlex.quote(named) if extra else named
    url = str(origin["url"])
    if "vcs_info" in origin:
        info = origin["vcs_info"]
        return shlex.quote(f"{named} @ {info['vcs']}+{url}@{info['commit_id']}")
    local = urlparse(url)
    if local.scheme == "file" and not Path(unquote(local.path)).exists():
        return None
    if "dir_info" in origin:
        folder = unquote(local.path)
        editable = "-e " if origin["dir_info"].get("editable") else ""
        return editable + shlex.quote(f"{folder}[{extra}]" if extra else folder)
    return shlex.quote(f"{named} @ {url}")


@cache
def _own() -> Distribution | None:
    try:
        return distribution(DISTRIBUTION)
    except PackageNotFoundError:  # run from a folder of sources
        return None


def _origin() -> dict[str, Any] | None:
    own = _own()
    text = own.read_text("direct_url.json") if own else None
    return json.loads(text) if text else None


def _requirements(extra: str) -> list[str]:
    """The requirements of an extra, such as `onnx<2,>=1.17`."""
    own = _own()
    each = (line.partition(";") for line in (own.requires if own else None) or [])
    return [
        requirement.strip()
        for requirement, _, marker in each
        if marker.replace("'", '"').strip() == f'extra == "{extra}"'
    ]


def _names_of(extra: str) -> list[str]:
    ends = " <>=!~[("
    return [
        requirement[: next((i for i, c in enumerate(requirement) if c in ends), None)]
        for requirement in _requirements(extra)
    ]


def _is_present(name: str) -> bool:
    try:
        distribution(name)
    except PackageNotFoundError:
        return False
    return True


def _uses_uv() -> bool:
    """Whether this environment has no pip, as those that uv makes."""
    return find_spec("pip") is None


def _installer() -> str:
    """The start of a command that installs into this environment, active or not."""
    python = Path(sys.executable)
    if _uses_uv():
        return f"uv pip install --python {shlex.quote(str(python))}"
    found = shutil.which("pip")
    if found and Path(found).parent == python.parent:
        return "pip install"
    return f"{shlex.quote(str(python))} -m pip install"
