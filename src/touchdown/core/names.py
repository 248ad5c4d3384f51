"""Names that people type: the known one nearest to a misspelt one, as the end of an error."""

import difflib
import glob
import itertools
import os
from collections.abc import Iterable
from pathlib import Path

from touchdown.core.errors import UserError

_LONGEST = 100  # characters; a longer name is no slip of the keyboard
_MANY = 1_000  # files of a folder in which a misspelt name is looked for
_FEW = 8  # names that an error message lists even beside a suggestion


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most similar to a misspelt one; None if there is none.

    Upper and lower case, dashes and underscores count as equal.
    """
    if len(name) > _LONGEST:
        return None
    plain = {_plain(each): each for each in reversed(list(known))}
    found = difflib.get_close_matches(_plain(name), plain, n=1)
    return plain[found[0]] if found else None


def hint(name: object, known: Iterable[str], lists: str = "") -> str:
    """The end of an error message about an unknown name: the nearest one, or all of them.

    Args:
        name: the unknown name, as given.
        known: the names that exist.
        lists: what lists them if they are many, such as "`touchdown presets` lists them".
    """
    names = list(known)
    near = nearest(str(name), names)
    if near is not None and (lists or len(names) > _FEW):
        return f"did you mean {near}?"
    listed = lists or f"must be one of {', '.join(names)}"
    return listed if near is None else f"{listed}; did you mean {near}?"


def check_misspelt(path: Path) -> None:
    """Refuse a file that a person named and that is missing, if there is one with a similar name.

    Raises:
        UserError: there is, beside it or in a folder beside it.
    """
    if not path.suffix or os.path.lexists(path):
        return
    try:
        found = next(path.parent.glob(f"*/{glob.escape(path.name)}"), None)
        beside = itertools.islice(path.parent.glob(f"*{glob.escape(path.suffix)}"), _MANY)
        near = nearest(path.stem, (each.stem for each in beside))
        if found is None and near is not None:
            found = path.with_name(near + path.suffix)
    except (OSError, ValueError):  # ValueError: a NUL in the path
        return
    if found is not None:
        raise UserError(f"{path}: no such file; did you mean {found}?")


def _plain(name: str) -> str:
    return name.lower().replace("_", "-")
