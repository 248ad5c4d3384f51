"""Start and actions of each training episode, from which the exact engine gives it again."""

import base64
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from touchdown.core import records
from touchdown.core.records import Count

_BITS = 2  # of an action
_A_BYTE = 8 // _BITS  # actions in it
_SHIFTS = np.arange(0, 8, _BITS, dtype=np.uint8)
_MASK = np.uint8((1 << _BITS) - 1)
_PLACES = 1 << _SHIFTS  # factors of the actions in a byte


@dataclass(frozen=True, slots=True, eq=False)
class TrainingFlight:
    """A training episode of the lander."""

    episode: int
    """Its number, as in `episodes.jsonl`."""
    start: int
    """Environment seed."""
    actions: NDArray[np.uint8]
    """[T]"""


class TrainingFlightRow(Struct, frozen=True, kw_only=True, gc=False):
    """A line of `training-flights.jsonl`."""

    episode: Count
    """Number of the episode, as in `episodes.jsonl`."""
    start: Count
    """Environment seed."""
    actions: str
    """Base64 of the packed actions."""
    steps: Count
    """T"""

    def __post_init__(self) -> None:
        try:
            packed = base64.b64decode(self.actions, validate=True)
        except ValueError:
            raise ValueError(f"actions = {self.actions[:40]!r}: must be base64") from None
        wanted = -(-self.steps // _A_BYTE)
        if len(packed) != wanted:
            raise ValueError(
                f"actions: has {len(packed)} bytes, must have {wanted} for steps = {self.steps}"
            )

    @classmethod
    def of(cls, episode: int, start: int, actions: ArrayLike) -> "TrainingFlightRow":
        """The line of an episode.

        Args:
            episode: its number.
            start: environment seed.
            actions: [T], each from 0 to 3.
        """
        chosen = np.asarray(actions, np.uint8)
        packed = base64.b64encode(pack_actions(chosen)).decode()
        return cls(episode=episode, start=start, actions=packed, steps=len(chosen))

    def flight(self) -> TrainingFlight:
        """The episode, with its actions unpacked."""
        actions = unpack_actions(base64.b64decode(self.actions), self.steps)
        return TrainingFlight(self.episode, self.start, actions)


def pack_actions(actions: NDArray[np.uint8]) -> bytes:
    """Four actions in a byte, the first in its lowest two bits.

    Args:
        actions: [T], each from 0 to 3.
    """
    padded = np.zeros((-(-len(actions) // _A_BYTE), _A_BYTE), np.uint8)
    padded.reshape(-1)[: len(actions)] = actions
    return (padded @ _PLACES).tobytes()


def unpack_actions(packed: bytes, steps: int) -> NDArray[np.uint8]:
    """The first `steps` of packed actions."""
    several = np.frombuffer(packed, np.uint8)[:, None] >> _SHIFTS
    return (several & _MASK).reshape(-1)[:steps]


def read_rows(path: Path) -> list[TrainingFlightRow]:
    """The lines of a file; empty without the file.

    Raises:
        UserError: the file is broken.
    """
    return records.decode_jsonl(path, TrainingFlightRow) if path.is_file() else []


def read_training_flights(path: Path) -> list[TrainingFlight]:
    """The training episodes in a file, in the order in which they ended; empty without the file.

    Raises:
        UserError: the file is broken.
    """
    return [row.flight() for row in read_rows(path)]
