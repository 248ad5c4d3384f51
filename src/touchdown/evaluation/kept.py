"""Test episodes of the baselines, computed once per version and machine and kept in the cache.

The baselines fly the same starts after every training, and none of them ever changes.
"""

import hashlib
from collections.abc import Iterator, Sequence
from functools import cache as once
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from msgspec import Struct

from touchdown.core import cache, files, installation, records
from touchdown.core.errors import UserError
from touchdown.evaluation.evaluation import Evaluation
from touchdown.lander import rules

_SOURCES = ("core", "envs", "evaluation", "lander", "policies", "stats")
"""Packages whose code decides what a baseline's episodes are."""
_LIBRARIES = ("gymnasium", "box2d", "numpy", "scipy")


class _Kept(Struct, frozen=True):
    evaluation: Evaluation


def read(name: str, env_id: str, starts: Sequence[int]) -> Evaluation | None:
    """A baseline's episodes from these starts, if they were kept.

    Args:
        name: name of the baseline.
        env_id: the environment.
        starts: environment seeds.
    """
    path = _path(name, env_id, starts)
    if path is None:
        return None
    try:
        found = records.decode_json(path, _Kept).evaluation
    except UserError:  # missing or damaged: they are computed again
        return None
    flown = [episode.seed for episode in found.episodes]
    return found if (found.name, found.env_id, flown) == (name, env_id, list(starts)) else None


def keep(evaluation: Evaluation, starts: Sequence[int]) -> None:
    """Keep a baseline's episodes for later; nothing happens where that is not possible."""
    path = _path(evaluation.name, evaluation.env_id, starts)
    if path is None:
        return
    try:
        files.write_atomic(path, files.to_json({"evaluation": evaluation.to_json()}))
    except UserError:  # a full disk: they are computed again
        return


def _path(name: str, env_id: str, starts: Sequence[int]) -> Path | None:
    """The file of these episodes; None for an environment that is not ours, and may change."""
    folder = cache.folder("baselines") if rules.is_lander(env_id) else None
    if folder is None:
        return None
    asked = f"{_code()} {name} {env_id} {list(starts)}"
    return folder / f"{name}-{hashlib.sha256(asked.encode()).hexdigest()[:16]}.json"


@once
def _code() -> str:
    """A digest of the code and the libraries that the episodes come from."""
    parts = [repr(sorted(installation.versions(_LIBRARIES).items())).encode()]
    for package in _SOURCES:
        parts += _contents(resources.files("touchdown") / package)
    return hashlib.sha256(b"".join(parts)).hexdigest()


def _contents(folder: Traversable) -> Iterator[bytes]:
    for each in sorted(folder.iterdir(), key=lambda path: path.name):
        if each.is_dir():
            yield from _contents(each)
        elif each.name.endswith((".py", ".toml")):
            yield each.read_bytes()
