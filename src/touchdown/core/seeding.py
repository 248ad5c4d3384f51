"""One seed gives named, independent streams of random numbers, and each episode's start."""

from typing import NamedTuple

from numpy.random import Generator, SeedSequence, default_rng

from touchdown.core.starts import TEST_STARTS, TRAINING_STARTS, VALIDATION_STARTS

__all__ = [
    "TEST_STARTS",
    "TRAINING_STARTS",
    "VALIDATION_STARTS",
    "Streams",
    "streams",
    "training_start",
    "tuning_starts",
]

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
