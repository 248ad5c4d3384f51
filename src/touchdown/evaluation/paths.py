"""Paths: positions of the lander in the first flights of an evaluation, in a compact file."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from touchdown.core import files, records
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray, IntArray

FORMAT_VERSION = 1
NUM_PATHS = 30
"""Number of test starts whose paths are kept, enough to compare two policies."""

FlightPath = NDArray[np.float32]
"""x and y as the environment observes them, in half viewports, at each observation: [T + 1, 2]."""
FlightPaths = Mapping[int, FlightPath]
"""Paths by the start's environment seed."""


class PathRecorder:
    """An observer of a rollout that keeps the paths of its first episodes.

    Args:
        starts: starts of the rollout.
        count: number of starts to keep, from the first.
    """

    def __init__(self, starts: Sequence[int], count: int = NUM_PATHS) -> None:
        self._starts = starts[:count]
        self._points: list[list[FloatArray]] = [[] for _ in self._starts]

    def __call__(self, places: IntArray, observations: FloatArray) -> None:
        """Keep the positions in these observations; see `Observer`."""
        for place, observation in zip(places.tolist(), observations, strict=True):
            if place < len(self._points):
                self._points[place].append(observation[:2].copy())

    @property
    def paths(self) -> FlightPaths:
        """The paths of the episodes that have ended."""
        return {
            start: np.array(points, np.float32)
            for start, points in zip(self._starts, self._points, strict=True)
        }


def save_paths(path: Path, paths: FlightPaths) -> None:
    """Write paths as one safetensors file.

    Raises:
        UserError: the file cannot be written.
    """
    tensors = {str(start): points for start, points in paths.items()}
    metadata = {"format_version": str(FORMAT_VERSION), "starts": json.dumps(list(paths))}
    with files.refusing(str(path)):
        files.write_atomic(path, files.to_safetensors(tensors, metadata), follow=False)


def load_paths(path: Path) -> FlightPaths:
    """The paths in a file from `save_paths`, in order.

    Raises:
        UserError: the file is missing, truncated, of another version, or something else.
    """
    tensors, metadata = files.read_tensors(path)
    records.check_readable(metadata.get("format_version"), [str(FORMAT_VERSION)], path)
    try:
        found = {int(start): tensors[str(start)] for start in json.loads(metadata["starts"])}
    except (KeyError, TypeError, ValueError):
        raise UserError(f"{path}: not recorded paths") from None
    for start, points in found.items():
        if points.ndim != 2 or points.shape[1] != 2 or not len(points):
            raise UserError(
                f"{path}: the path from start {start} is {points.shape}, not [T + 1, 2]"
            )
    return found
