"""One seed gives named, independent streams, and three sets of starts that never overlap."""

from typing import NamedTuple

from numpy.random import Generator, SeedSequence, default_rng

TEST_STARTS = range(1_000_000)
"""Environment seeds that only reporting may fly; the first 100 are the usual test."""
VALIDATION_STARTS = range(1_000_000, 2_000_000)
"""Environment seeds that choose a checkpoint."""
TRAINING_STARTS = range(2_000_000, 2**31)
"""Environment seeds that training draws from."""

_STARTS, _TUNING = 101, 102  # spawn keys beside the streams', so that adding a stream moves none


class Streams(NamedTuple):
    """A run's generators, each for one purpose."""

    exploration: Generator
    replay: Generator


def streams(seed: int) -> Streams:
    """Independent generators from one seed."""
    return Streams(*map(default_rng, SeedSequence(seed).spawn(2)))


def training_start(seed: int, episode: int) -> int:
    """The environment seed of a training episode, a function of the run's seed and the episode.

    An episode that was interrupted can so be flown again from the same start.
    """
    return _draw(SeedSequence(seed, spawn_key=(_STARTS, episode)))


def tuning_starts(seed: int, count: int) -> list[int]:
    """Training starts for tuning a controller, drawn apart from every run's episodes."""
    return [_draw(SeedSequence(seed, spawn_key=(_TUNING, i))) for i in range(count)]


def _draw(sequence: SeedSequence) -> int:
    return int(default_rng(sequence).integers(TRAINING_STARTS.start, TRAINING_STARTS.stop))
