"""The policies at the validations of a run, which show what training learned and when."""

import re
from pathlib import Path
from typing import NamedTuple

from touchdown.core.errors import UnreadableError, one_line
from touchdown.runs.folder import RunFolder

_NAME = re.compile(r"([0-9]{8,})\.safetensors")


class SavedPolicy(NamedTuple):
    """The file of a policy at a validation."""

    env_steps: int
    """Environment steps of training until then; 0 before training."""
    path: Path
    """Its weights, in the format of `best.safetensors`."""


def path_at(folder: RunFolder, env_steps: int) -> Path:
    """The file of the policy after a number of environment steps."""
    return folder.over_training / f"{env_steps:08d}.safetensors"


def policies_over_training(folder: RunFolder) -> list[SavedPolicy]:
    """The saved policies of a run, the earliest first; empty if it saved none.

    Raises:
        UnreadableError: their folder cannot be read, or is a symbolic link.
    """
    where = folder.over_training
    if where.is_symlink():
        raise UnreadableError(f"{where}: is a symbolic link, must be a folder")
    try:
        named = [(_NAME.fullmatch(path.name), path) for path in where.iterdir()]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise UnreadableError(f"{where}: cannot be read: {one_line(error)}") from None
    return sorted(SavedPolicy(int(name[1]), path) for name, path in named if name)
