"""Runs to watch, and a client that asks a server of pages."""

import base64
import json
import threading
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
from http.client import HTTPConnection, HTTPMessage, HTTPResponse
from pathlib import Path
from typing import Any, NamedTuple

from small_configs import tiny
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.web.watch.run_index import RunIndex
from touchdown.web.watch.serving import Server


def episode(number: int, **changes: Any) -> dict[str, Any]:
    """A line of `episodes.jsonl`."""
    return {
        "episode": number,
        "observations": 100 * number,
        "episode_return": -float(number),
        "steps": 100,
        "outcome": "crashed",
        "epsilon": 0.5,
        "seconds": 0.1 * number,
    } | changes


def append(path: Path, *rows: dict[str, Any]) -> None:
    """Append lines to a record."""
    with path.open("a") as file:
        file.writelines(json.dumps(row) + "\n" for row in rows)


def new_run(runs: Path, name: str, env_id: str = "LunarLander-v3") -> RunFolder:
    """A run that has recorded nothing yet."""
    return folders.create(runs, tiny(env_id), name)


def recorded_run(runs: Path, name: str = "watched") -> RunFolder:
    """A lander's run with three episodes, an update, a validation, a flight and two policies."""
    folder = new_run(runs, name)
    append(folder.episodes, *(episode(number) for number in (1, 2, 3)))
    append(folder.updates, {"update": 1, "observations": 60, "loss": 0.5, "mean_q": 1.5})
    append(
        folder.validations,
        {
            "observations": 300,
            "episode": 3,
            "mean_return": 10.0,
            "returns": [-20.0, 40.0],
            "time_limit_share": 0.0,
        },
    )
    append(folder.training_flights, flight(2))
    folder.over_training.mkdir()
    for steps in (0, 300):
        (folder.over_training / f"{steps:08d}.safetensors").write_bytes(b"weights %d" % steps)
    return folder


def flight(number: int) -> dict[str, Any]:
    """A line of `training-flights.jsonl`: actions 3, 2, 1, 0."""
    actions = base64.b64encode(bytes([0b00_01_10_11])).decode()
    return {"episode": number, "start": 77, "actions": actions, "steps": 4}


class Answer(NamedTuple):
    """What a server answered."""

    status: int
    headers: HTTPMessage
    body: bytes


class Client:
    """Asks a server."""

    def __init__(self, server: Server) -> None:
        self.server = server

    def ask(
        self, path: str, method: str = "GET", token: str | None = None, **headers: str
    ) -> Answer:
        """The answer.

        Args:
            path: below the token.
            method: of HTTP.
            token: another one than the server's.
            headers: by name.
        """
        with self._connected() as connection:
            start = f"/{self.server.token if token is None else token}/"
            connection.request(method, start + path, headers=headers)
            answer = connection.getresponse()
            return Answer(answer.status, answer.headers, answer.read())

    def json(self, path: str) -> Any:
        """The value at an address."""
        answer = self.ask(path)
        assert answer.status == 200, answer.body
        return json.loads(answer.body)

    @contextmanager
    def messages(self, *keys: str) -> Generator[Iterator[dict[str, Any]]]:
        """What the server sends of runs, without end."""
        with self._connected() as connection:
            query = "&".join(f"run={key}" for key in keys)
            connection.request("GET", f"/{self.server.token}/events?{query}")
            with connection.getresponse() as answer:
                assert answer.headers["Content-Type"].startswith("text/event-stream")
                yield _each(answer)

    def _connected(self) -> closing[HTTPConnection]:
        return closing(HTTPConnection("127.0.0.1", self.server.port, timeout=10))


def _each(answer: HTTPResponse) -> Iterator[dict[str, Any]]:
    while line := answer.readline():
        if line.startswith(b"data: "):
            yield json.loads(line[len(b"data: ") :])


class Servers:
    """Starts servers in threads, which all end together."""

    def __init__(self) -> None:
        self._end = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self, index: RunIndex) -> Server:
        """A server of the runs on a index."""
        server = Server(index)
        ends = (lambda _last_used: self._end.is_set(),)
        self._threads.append(threading.Thread(target=server.serve, args=ends))
        self._threads[-1].start()
        return server

    def end(self) -> None:
        """End them all."""
        self._end.set()
        for thread in self._threads:
            thread.join(10)
            assert not thread.is_alive()
        self._threads.clear()
