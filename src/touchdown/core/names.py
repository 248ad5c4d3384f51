"""Names that people type: the known one nearest to a misspelt one, as the end of an error."""

import difflib
from collections.abc import Iterable

_LONGEST = 100  # characters; a longer name is no slip of the keyboard
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


def _plain(name: str) -> str:
    return name.lower().replace("_", "-")
