"""Saved policies and recorded training episodes of a run, for a page that flies them."""

import re
from pathlib import Path
from typing import Any

import msgspec

from touchdown.core import limits
from touchdown.core.errors import UserError
from touchdown.core.reading import read_bytes
from touchdown.runs.folder import RunFolder
from touchdown.runs.over_training import path_at
from touchdown.runs.training_flights import TrainingFlightRow, read_rows

BEST = "best"
"""Stands for the number of environment steps of the best policy."""
_NUMBER = re.compile(r"[0-9]{1,18}")


def read_policy(folder: RunFolder, env_steps: str) -> bytes:
    """The weights of a policy.

    Args:
        folder: the run's folder.
        env_steps: environment steps of training until it was saved, or `best`.

    Raises:
        UserError: there is none, or it lies outside the run's folder.
    """
    if env_steps == BEST:
        path = folder.best
    elif _NUMBER.fullmatch(env_steps):
        path = path_at(folder, int(env_steps))
    else:
        raise UserError(f"policy: must be a number of environment steps or {BEST}")
    _check_inside(folder, path)
    return read_bytes(path, limits.WEIGHTS_BYTES, follow=False)


def read_episode(folder: RunFolder, number: str) -> dict[str, Any]:
    """Start and actions of a training episode, as in `training-flights.jsonl`.

    Args:
        folder: the run's folder.
        number: of the episode, in decimal digits.

    Raises:
        UserError: it is no number, it was not recorded, or the file is broken or lies outside the
            run's folder.
    """
    if not _NUMBER.fullmatch(number):
        raise UserError("episode: must be a number")
    for row in _rows(folder):
        if row.episode == int(number):
            return msgspec.to_builtins(row)
    raise UserError(f"episode {number}: was not recorded")


def read_episodes(folder: RunFolder) -> list[dict[str, Any]]:
    """All recorded training episodes; empty if there are none.

    Raises:
        UserError: the file is broken or lies outside the run's folder.
    """
    return [msgspec.to_builtins(row) for row in _rows(folder)]


def _rows(folder: RunFolder) -> list[TrainingFlightRow]:
    path = folder.training_flights
    if path.is_file():
        _check_inside(folder, path)
    return read_rows(path)


def _check_inside(folder: RunFolder, path: Path) -> None:
    """Refuse a path that symbolic links lead out of a run's folder."""
    try:
        is_inside = path.resolve(strict=True).is_relative_to(folder.path.resolve())
    except (OSError, RuntimeError):
        is_inside = False
    if not is_inside:
        raise UserError(f"{path.name}: there is no such file in the run")
