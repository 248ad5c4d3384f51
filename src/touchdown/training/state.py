"""`state.json` of a checkpoint: the part of a run's state that is not an array."""

from typing import Any, Literal

import msgspec
from msgspec import Struct
from numpy.random import Generator

from touchdown.core.records import Count, Seconds

FORMAT_VERSION = 4
READABLE = (3, FORMAT_VERSION)
"""Version 3 has no digests of `state.json` and of the records."""
_STORED = {"env_steps": "observations", "candidates": "finalists"}  # names in the file
_RECORDS = ("episodes.jsonl", "updates.jsonl", "validations.jsonl")


class Solved(Struct, frozen=True):
    """Evidence from validation starts that a policy solves its environment."""

    seconds: Seconds
    """Seconds of training until then, including validation."""
    mean_return: float
    """Mean return on fresh validation starts."""
    episodes: Count
    """Number of these starts."""


class CandidateState(Struct, frozen=True, kw_only=True, rename=_STORED):
    """A candidate checkpoint, without its weights."""

    env_steps: Count
    validation_return: float


class _PCG64(Struct, frozen=True):
    """Two numbers of 128 bits (O'Neill, 2014)."""

    state: int
    inc: int

    def __post_init__(self) -> None:
        if not 0 <= self.state < 2**128:
            raise ValueError(f"state = {self.state}: must be from 0 to 2**128 - 1")
        if not 0 < self.inc < 2**128 or self.inc % 2 == 0:
            raise ValueError(f"inc = {self.inc}: must be an odd number from 1 to 2**128 - 1")


class GeneratorState(Struct, frozen=True):
    """A random generator's state, as in NumPy."""

    bit_generator: Literal["PCG64"]
    state: _PCG64
    has_uint32: Literal[0, 1]
    """Whether half of a 64-bit draw is unused."""
    uinteger: Count
    """That half."""

    def __post_init__(self) -> None:
        if self.uinteger >= 2**32:
            raise ValueError(f"uinteger = {self.uinteger}: must be from 0 to 2**32 - 1")

    @classmethod
    def of(cls, generator: Generator) -> "GeneratorState":
        """The state of a generator."""
        return msgspec.convert(generator.bit_generator.state, cls)

    def restore(self, generator: Generator) -> None:
        """Set a generator to this state."""
        generator.bit_generator.state = msgspec.to_builtins(self)


class CheckpointState(Struct, frozen=True, kw_only=True, rename=_STORED):
    """`state.json`."""

    format_version: Literal[3, 4] = FORMAT_VERSION
    config_digest: str
    episodes: Count
    """Number of finished training episodes."""
    env_steps: Count
    """Environment steps of all environments."""
    agent: dict[str, Any]
    """The part of the agent's state that is not arrays."""
    next_validation: Count
    """Environment steps at the next validation."""
    seconds: Seconds
    """Of training."""
    trained: bool
    finished: bool
    solved: Solved | None
    underway: list[Count]
    """The episode number of each environment."""
    candidates: list[CandidateState]
    """Best first."""
    streams: dict[str, GeneratorState]
    record_sizes: dict[str, Count]
    """Size of each record in bytes, by file name."""
    record_sha256: dict[str, str] = msgspec.field(default_factory=dict[str, str])
    """SHA-256 of these bytes of each JSON Lines record, by file name."""
    sha256: dict[str, str]
    """SHA-256 of each file in the folder, by its name without the suffix."""

    def __post_init__(self) -> None:
        for name in _RECORDS:
            if name not in self.record_sizes:
                raise ValueError(f"record_sizes: {name}: missing")
        if self.finished and not self.trained:
            raise ValueError("finished = True: must be False with trained = False")
        if self.trained and not self.candidates:
            raise ValueError("finalists = []: must have at least 1 with trained = True")
        if not self.trained and not self.underway:
            raise ValueError("underway = []: must have at least 1 with trained = False")
