"""Results of runs as lines of a file, to continue a study on another machine.

A line has the numbers that claims, tables and figures need; not the flights.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta, Struct

from touchdown.core import files, limits, reading, records
from touchdown.core.errors import UserError
from touchdown.core.records import Count
from touchdown.core.types import FloatArray
from touchdown.runs.rows import EpisodeRow
from touchdown.stats.summary import Summary

FORMAT_VERSION = 1
_BINS = 24  # of training, for its episodes

Digest = Annotated[str, Meta(pattern="^[0-9a-f]{12}$", description="12 hex digits")]
Curve = tuple[tuple[float, ...], tuple[float, ...]]
"""Environment steps, increasing, and a number at each."""


class Origin(Struct, frozen=True, kw_only=True):
    """What made a run, as far as it is recorded."""

    git_commit: str | None = None
    cpu: str = ""
    simd: str | None = None
    """Instruction set of the C++ code."""


class TrainingParts(Struct, frozen=True, kw_only=True):
    """Training episodes over equal parts of training, in which at least one ended."""

    ends: tuple[float, ...]
    """Environment steps at the end of each part."""
    hovering: tuple[float, ...]
    """Share of the episodes that reached the time limit."""
    returns: tuple[float, ...]
    """Mean return."""
    steps: tuple[float, ...]
    """Mean number of steps."""


def parts_of(episodes: Sequence[EpisodeRow]) -> TrainingParts:
    """Summarise training episodes; parts in which none ended are left out."""
    ends = np.array([row.env_steps for row in episodes], float)
    edges: FloatArray = np.linspace(0.0, float(ends[-1]), _BINS + 1)
    place = np.clip(np.searchsorted(edges, ends, side="left") - 1, 0, _BINS - 1)
    counts = np.bincount(place, minlength=_BINS)
    seen = counts > 0

    def means(values: Sequence[float]) -> tuple[float, ...]:
        sums = np.bincount(place, weights=np.asarray(values, float), minlength=_BINS)
        return tuple((sums[seen] / counts[seen]).tolist())

    return TrainingParts(
        ends=tuple(edges[1:][seen].tolist()),
        hovering=means([row.outcome == "timed out" for row in episodes]),
        returns=means([row.episode_return for row in episodes]),
        steps=means([row.steps for row in episodes]),
    )


_OF_PARTS = ("hovering", "returns", "steps")


class _Header(Struct, frozen=True, forbid_unknown_fields=True):
    """The first line."""

    format_version: Literal[1]
    runs: Count
    """Number of the other lines."""


class RunLine(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Any other line: the results of one run."""

    run: Digest
    """The digest of its settings."""
    study: str
    """A study that contains it, for readers of the file."""
    level: str
    seed: Count
    origin: Origin
    numbers: dict[str, float | None]
    """By the name of a field of `RunResult`; None if it is not finite."""
    env_steps: Count
    test: Summary | None
    validations: Curve
    parts: TrainingParts


def write(path: Path, lines: Iterable[RunLine]) -> None:
    """Write a file of lines, completely or not at all.

    Raises:
        UserError: it cannot be written.
    """
    with files.refusing(str(path)):
        rows = [files.to_json_line(line) for line in lines]
        header = files.to_json_line(_Header(FORMAT_VERSION, len(rows)))
        files.write_atomic(path, header + b"".join(rows))


def read(path: Path) -> Mapping[str, RunLine]:
    """The lines of a file by the digest of their run; empty if there is no such file.

    Raises:
        UserError: it is something else, of another version, or damaged.
    """
    try:
        stat = path.stat()
    except OSError:
        return {}
    return _read(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=4)  # a study asks for each of its runs
def _read(path: Path, _changed: int, _size: int) -> Mapping[str, RunLine]:
    data = reading.read_bytes(path, limits.RECORD_BYTES)
    first, _, rest = data.partition(b"\n")
    header = records.decode(first, _Header, f"{path}: line 1")
    lines = records.decode_lines(rest[: rest.rfind(b"\n") + 1], RunLine, path, 2)
    if len(lines) != header.runs:
        raise UserError(f"{path}: has {len(lines)} of {header.runs} runs; it is truncated")
    for number, line in enumerate(lines, start=2):
        said = _curve_error(line)
        if said:
            raise UserError(f"{path}: line {number}: {said}")
    return {line.run: line for line in lines}


def _curve_error(line: RunLine) -> str | None:
    """What is wrong with the curves of a line; None if nothing is."""
    parts = line.parts
    for name, curve in (
        ("validations", line.validations),
        *((f"parts.{of}", (parts.ends, getattr(parts, of))) for of in _OF_PARTS),
    ):
        at, values = curve
        if not at or len(at) != len(values) or any(b < a for a, b in pairwise(at)):
            return f"{name}: must be as many numbers as steps, at least 1, and steps in order"
    return None


def as_numbers(values: Mapping[str, float]) -> dict[str, float | None]:
    """Numbers as JSON can say them."""
    return {name: value if math.isfinite(value) else None for name, value in values.items()}
