"""A run, and servers that show it."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

import pytest

from touchdown.runs.folder import RunFolder
from touchdown.web.watch.run_index import RunIndex, key_of
from watched_runs import Client, Servers, recorded_run


@pytest.fixture
def run(tmp_path: Path) -> RunFolder:
    return recorded_run(tmp_path / "runs")


@contextmanager
def _serving() -> Generator[Callable[[RunIndex], Client]]:
    servers = Servers()
    yield lambda index: Client(servers.start(index))
    servers.end()


@pytest.fixture
def serve() -> Generator[Callable[[RunIndex], Client]]:
    """Starts servers, which end with the test."""
    with _serving() as start:
        yield start


@pytest.fixture(scope="module")
def unchanged(tmp_path_factory: pytest.TempPathFactory) -> Generator[tuple[Client, str]]:
    """A server for tests that change nothing, and the key of its run."""
    folder = recorded_run(tmp_path_factory.mktemp("served") / "runs")
    with _serving() as start:
        yield start(RunIndex(folder.path.parent)), key_of(folder)
