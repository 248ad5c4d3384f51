"""Writes the page of runs as one file that opens from disk."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.runs.folder import RunFolder
from touchdown.web.watch import flights, pages
from touchdown.web.watch.records import Cursor, WatchedRun
from touchdown.web.watch.run_index import RunIndex

MOST_BYTES = 16_000_000
"""Of weights in a file, and as many of recorded episodes; of more, some are left out, evenly."""


@dataclass(frozen=True, slots=True)
class _Content:
    messages: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    episodes: dict[str, Any] = field(default_factory=dict[str, Any])
    policies: dict[str, bytes] = field(default_factory=dict[str, bytes])


def write_page(index: RunIndex, keys: Sequence[str], out: Path) -> None:
    """Write the page of runs, with their saved policies and recorded episodes.

    Args:
        index: where the runs are found.
        keys: the runs.
        out: the file.

    Raises:
        UserError: a run cannot be read at all, or the file cannot be written.
    """
    content = _Content()
    labels: list[str] = []
    for key in keys:
        found = index.find(key)
        if found is None:
            raise UserError(f"run {key!r}: was deleted")
        run = WatchedRun(found.folder, key, found.label, found.group)
        labels.append(run.label)
        _add(content, run, MOST_BYTES // len(keys))
    title = labels[0] if len(labels) == 1 else f"{len(labels)} runs"
    html = pages.file_page(keys, title, content.messages, content.episodes, content.policies)
    with files.refusing(f"out {str(out)!r}"):
        files.write_atomic(out, html)


def _add(content: _Content, run: WatchedRun, most: int) -> None:
    """Add a run to what a file contains.

    Args:
        content: what it contains so far.
        run: the run.
        most: bytes of weights, and as many of episodes.
    """
    is_all = False
    while not is_all:
        reading = run.read()
        run.take(reading)
        is_all = reading.is_all
    messages = list(run.since(Cursor()))
    facts = messages[0]["facts"]
    if facts["status"] == "gone":
        raise UserError(f"run {run.folder.name!r}: was deleted")
    if facts["status"] == "damaged":
        raise UserError(facts["error"])
    weights = dict(_weights(run.folder, facts["policies"], most))
    facts["policies"] = list(weights)
    if not weights and facts["has_best"]:
        content.policies[f"{run.key}/{flights.BEST}"] = flights.read_policy(
            run.folder, flights.BEST
        )
    episodes = _recorded(run.folder) if facts["has_flights"] else []
    characters = sum(len(row["actions"]) for row in episodes)
    for row in _evenly(episodes, len(episodes) * most // max(most, characters)):
        content.episodes[f"{run.key}/{row['episode']}"] = row
    content.messages.extend(messages)
    content.policies.update({f"{run.key}/{at}": data for at, data in weights.items()})


def _weights(folder: RunFolder, at: Sequence[int], most: int) -> Iterator[tuple[int, bytes]]:
    """Saved policies by their environment steps: as many as fit; a damaged one is left out."""
    sizes = (len(data) for each in at if (data := _policy(folder, each)) is not None)
    size = max(1, next(sizes, 1))
    for each in _evenly(at, max(2, most // size)):
        data = _policy(folder, each)
        if data is not None:
            yield each, data


def _policy(folder: RunFolder, env_steps: int) -> bytes | None:
    """The weights of a policy; None if they cannot be read."""
    try:
        return flights.read_policy(folder, str(env_steps))
    except UserError:
        return None


def _recorded(folder: RunFolder) -> list[dict[str, Any]]:
    try:
        return flights.read_episodes(folder)
    except UserError:  # the page says that an episode is not there
        return []


def _evenly(values: Sequence[Any], most: int) -> list[Any]:
    """All values, or `most` of them from the first to the last."""
    if len(values) <= most:
        return list(values)
    return [values[place] for place in np.linspace(0, len(values) - 1, most).round().astype(int)]
