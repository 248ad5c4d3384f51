"""Named, independent random streams from one seed, and the start of each episode."""

from typing import NamedTuple

from numpy.random import Generator, SeedSequence, default_rng

from touchdown.core.errors import UserError
from touchdown.core.starts import TRAINING_STARTS

_STARTS, _TUNING = 101, 102  # far from the streams' keys, so a new stream changes no start


class Streams(NamedTuple):
    """A run's random generators, each for one purpose."""

    exploration: Generator
    replay: Generator


def streams(seed: int) -> Streams:
    """Independent generators from one seed."""
    return Streams(*map(default_rng, SeedSequence(seed).spawn(2)))


def training_start(seed: int, episode: int) -> int:
    """The environment seed of a training episode, determined by the run's seed and the episode.

    So an interrupted episode can be repeated from the same start.
    """
    return _draw(SeedSequence(seed, spawn_key=(_STARTS, episode)))


def tuning_starts(seed: int, count: int) -> list[int]:
    """Training starts for tuning a controller, independent of the episodes of all runs."""
    return [_draw(SeedSequence(seed, spawn_key=(_TUNING, i))) for i in range(count)]


def check_seed(seed: int, count: int = 1) -> None:
    """Refuse a first environment seed if any of `count` seeds from it on is out of range.

    Raises:
        UserError: it is negative, or the last seed does not fit 31 bits.
    """
    if not 0 <= seed <= 2**31 - count:
        raise UserError(f"seed = {seed}: must be from 0 to {2**31 - count}")


def _draw(sequence: SeedSequence) -> int:
    return int(default_rng(sequence).integers(TRAINING_STARTS.start, TRAINING_STARTS.stop))
