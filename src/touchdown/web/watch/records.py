"""The records of one run as they grow, in the form in which pages draw them."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from touchdown.core.errors import UserError
from touchdown.runs.folder import RunFolder
from touchdown.runs.rows import EpisodeRow, ValidationRow
from touchdown.web.watch.columns import Columns, Position
from touchdown.web.watch.facts import Facts, read_facts
from touchdown.web.watch.tail import Added, Tail

UNDER_WAY_SECONDS = 0.3
"""Between two readings of a run that is training."""
AT_REST_SECONDS = 2.0
"""Between two readings of another run, which may be resumed or deleted."""

_Rows = Sequence[Mapping[str, Any]]


@dataclass(slots=True)
class Cursor:
    """What one page has been sent of one run."""

    facts: int = 0
    positions: dict[str, Position] = field(default_factory=dict[str, Position])


@dataclass(frozen=True, slots=True)
class Reading:
    """What one reading of a run's files gave."""

    facts: Facts
    added: dict[str, Added[Any]]
    is_another: bool = False
    """Whether the run was made again under the same name: nothing read before counts."""

    @property
    def is_all(self) -> bool:
        """Whether nothing is left to read at once."""
        return all(added.is_all for added in self.added.values())


class WatchedRun:
    """One run, read once for all pages that show it.

    Args:
        folder: the run's folder.
        key: names the run to pages.
        label: what pages call it.
        group: what it belongs to, such as a study; "" if nothing.
    """

    def __init__(self, folder: RunFolder, key: str, label: str, group: str = "") -> None:
        self.key = key
        self.label = label
        self.group = group
        self.folder = folder
        self.facts: Facts | None = None
        self._version = 0
        self._next = 0.0
        self._columns = {name: Columns() for name in (*_ROWS, _FIRSTS)}
        self._tails = _tails(folder)

    @property
    def is_due(self) -> bool:
        """Whether it is time to read the run again."""
        return time.monotonic() >= self._next

    def read(self) -> Reading:
        """Read what is new. It changes nothing that `since` uses, so that it may take a thread."""
        added: dict[str, Added[Any]] = {}
        try:
            facts = read_facts(self.folder, self.label, self.group, self.facts)
        except OSError as error:
            return Reading(self._known().with_error(error), added)
        # a deleted run keeps the identity that it had
        is_another = self.facts is not None and facts.config_file != self.facts.config_file
        if is_another:
            self._tails = _tails(self.folder)
        for name, tail in self._tails.items():
            try:
                added[name] = tail.read()
            except (OSError, UserError) as error:
                facts = facts.with_error(error)
        return Reading(facts, added, is_another)

    def _known(self) -> Facts:
        if self.facts is not None:
            return self.facts
        return Facts(label=self.label, group=self.group, status="damaged")

    def take(self, reading: Reading) -> bool:
        """Take over a reading.

        Returns:
            Whether there is anything new for pages.
        """
        pause = UNDER_WAY_SECONDS if reading.facts.status == "training" else AT_REST_SECONDS
        self._next = time.monotonic() + (pause if reading.is_all else 0.0)
        is_new = reading.facts != self.facts
        if is_new:
            self.facts = reading.facts
            self._version += 1
        if reading.is_another:
            for columns in self._columns.values():
                columns.restart()
        for name, added in reading.added.items():
            rows = _ROWS[name](added.rows)
            if added.restarted:
                self._columns[name].restart()
            self._columns[name].extend(rows)
            if name == "episodes":
                self._take_firsts(rows, restarted=added.restarted)
            is_new = is_new or added.restarted or bool(added.rows)
        return is_new

    def _take_firsts(self, rows: _Rows, *, restarted: bool) -> None:
        """Keep the first episode with each outcome, which a long record may leave out."""
        firsts = self._columns[_FIRSTS]
        if restarted:
            firsts.restart()
        for row in rows:
            if row["outcome"] not in firsts.column("outcome"):
                firsts.extend([row])

    def since(self, cursor: Cursor) -> Iterator[dict[str, Any]]:
        """The messages that a page lacks; the cursor moves with each that is taken."""
        if self.facts is None:  # not read yet
            return
        if cursor.facts != self._version:
            cursor.facts = self._version
            yield {"run": self.key, "facts": self.facts.to_json()}
        for name, columns in self._columns.items():
            for part, position in columns.since(cursor.positions.get(name, Position())):
                cursor.positions[name] = position
                yield {"run": self.key, "record": name, **part}


def _tails(folder: RunFolder) -> dict[str, Tail[Any]]:
    return {
        "episodes": Tail(folder.episodes, EpisodeRow),
        "updates": Tail(folder.updates, dict[str, float]),
        "validations": Tail(folder.validations, ValidationRow),
    }


def _episodes(rows: Sequence[EpisodeRow]) -> _Rows:
    return [
        {
            "episode": row.episode,
            "env_steps": row.env_steps,
            "episode_return": row.episode_return,
            "steps": row.steps,
            "outcome": row.outcome,
            "epsilon": row.epsilon,
            "seconds": row.seconds,
        }
        for row in rows
    ]


def _updates(rows: Sequence[dict[str, float]]) -> _Rows:
    return [{_DRAWN[name]: value for name, value in row.items() if name in _DRAWN} for row in rows]


def _validations(rows: Sequence[ValidationRow]) -> _Rows:
    return [
        {
            "env_steps": row.env_steps,
            "episode": row.episode,
            "mean_return": row.mean_return,
            "worst_return": min(row.returns, default=row.mean_return),
            "best_return": max(row.returns, default=row.mean_return),
        }
        for row in rows
    ]


_DRAWN = {"observations": "env_steps", "loss": "loss", "mean_q": "mean_q", "max_q": "max_q"}
"""What pages call the values of an update that they draw."""
_ROWS = {"episodes": _episodes, "updates": _updates, "validations": _validations}
_FIRSTS = "firsts"
