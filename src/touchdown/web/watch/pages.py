"""The pages as HTML: the list of runs, and the page on which runs are watched."""

from collections.abc import Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from touchdown.core.errors import UserError
from touchdown.core.reading import read_bytes
from touchdown.web import page
from touchdown.web.watch.run_index import IndexedRun, RunIndex

CHARTS = "plotly.min.js"
_STATIC = "./static/"


def runs_page(index: RunIndex) -> str:
    """The list of all runs."""
    return page.render(
        "runs.html.j2",
        title="Runs",
        data={"runs": index.listing()},
        binaries={},
        modules_at=_STATIC,
    )


def live_page(keys: Sequence[str], found: Sequence[IndexedRun]) -> str:
    """The page that follows runs.

    Args:
        keys: as requested.
        found: those of them that there are.
    """
    title = f"{len(keys)} runs"
    if len(keys) == 1:
        title = found[0].label if found else "Unknown run"
    return page.render(
        "watch.html.j2",
        title=title,
        data={"live": True, "runs": list(keys), "messages": []},
        binaries={page.ENGINE: page.static_file(page.ENGINE)},
        modules_at=_STATIC,
    )


def file_page(
    keys: Sequence[str],
    title: str,
    messages: Sequence[Mapping[str, Any]],
    episodes: Mapping[str, Any],
    policies: Mapping[str, bytes],
) -> str:
    """The page as one file that opens from disk.

    Args:
        keys: the runs.
        title: of the page.
        messages: what a server would send of them.
        episodes: start and actions of training episodes, by `KEY/NUMBER`.
        policies: weights, by `KEY/ENV_STEPS`.
    """
    return page.render(
        "watch.html.j2",
        title=title,
        data={"live": False, "runs": list(keys), "messages": messages, "episodes": episodes},
        binaries={page.ENGINE: page.static_file(page.ENGINE), **policies},
        script=charts_script().decode(),
    )


@cache
def charts_script() -> bytes:
    """Plotly's script, from the installed package, which is not imported.

    Raises:
        UserError: the package is missing, or has no script.
    """
    found = find_spec("plotly")
    if found is None or found.origin is None:
        raise UserError("plotly: is not installed; install touchdown again")
    return read_bytes(Path(found.origin).parent / "package_data" / CHARTS)
