"""Files with something wrong in them, as a slip, a broken disk or a stranger leaves them."""

import json
import os
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import tomli_w
from hypothesis import strategies as st

from single_changes import changed, places, without

NUMBERS = st.sampled_from([-1, 0, 1, 2, 7, 1000, 2**31, 2**63, 2**64, -(2**63), 10**30, 10**400])
FLOATS = st.sampled_from([-1.0, -0.0, 0.5, 1e-320, 1e38, 1e300]) | st.floats()
_TEXTS = [
    *("", "x", "None", "nan", "1", "../../x", "/dev/zero", "é" * 300, "a\nb", "{", "%s"),
    *("LunarLander-v3", "CartPole-v1", "os:system"),
    *("\x1b[31m", "[red]", "[/]", "$x_{$", "<script>", "\ud800"),
]
TEXTS = st.sampled_from(_TEXTS) | st.text(max_size=8)
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | FLOATS | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=4,
)


def _change(draw: st.DrawFn, record: Any) -> Any:
    """A record with one or two values changed, gone or added."""
    for _ in range(draw(st.integers(1, 2))):
        place = draw(st.sampled_from(list(places(record))))
        kind = draw(st.integers(0, 9))
        if kind < 7:
            record = changed(record, place, draw(VALUES))
        elif kind < 9 and place:
            record = without(record, place)
        elif isinstance(record, dict):
            record = record | {draw(TEXTS): draw(VALUES)}
    return record


def _as_json(draw: st.DrawFn, data: bytes) -> bytes:
    return json.dumps(_change(draw, json.loads(data))).encode()


def _as_lines(draw: st.DrawFn, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    at = draw(st.integers(0, len(lines) - 1))
    kind = draw(st.integers(0, 9))
    if kind < 7:
        lines[at] = _as_json(draw, lines[at]) + b"\n"
    elif kind == 7:
        del lines[at]
    elif kind == 8:
        lines.insert(at, lines[draw(st.integers(0, len(lines) - 1))])
    else:
        lines[at] = lines[at].rstrip(b"\n")
    return b"".join(lines)


def _as_toml(draw: st.DrawFn, data: bytes) -> bytes:
    values = _change(draw, tomllib.loads(data.decode()))
    try:
        return tomli_w.dumps(values).encode()
    except (TypeError, AttributeError, UnicodeEncodeError):  # TOML has no null, and is a table
        return repr(values).encode("utf-8", "surrogatepass")


def _as_tensors(draw: st.DrawFn, data: bytes) -> bytes:
    """A safetensors file with a changed header."""
    size = int.from_bytes(data[:8], "little")
    header = _as_json(draw, data[8 : 8 + size])
    return len(header).to_bytes(8, "little") + header + data[8 + size :]


def _as_bytes(draw: st.DrawFn, data: bytes) -> bytes:
    """Cut, with other bytes in a place, or with some more."""
    at = draw(st.integers(0, len(data)))
    kind = draw(st.integers(0, 3))
    if kind == 0:
        return data[:at]
    more = draw(st.binary(max_size=6))
    return data[:at] + more + data[at + (len(more) if kind < 3 else 0) :]


_BY_SUFFIX: dict[str, Callable[[st.DrawFn, bytes], bytes]] = {
    ".json": _as_json,
    ".jsonl": _as_lines,
    ".toml": _as_toml,
    ".safetensors": _as_tensors,
}


def damage(draw: st.DrawFn, path: Path) -> None:
    """Do something to a file."""
    kind = draw(st.integers(0, 19))
    if kind >= 4:
        data = path.read_bytes()
        by_suffix = _BY_SUFFIX.get(path.suffix)
        change = by_suffix if by_suffix and data and kind >= 8 else _as_bytes
        path.write_bytes(change(draw, data))
        return
    path.unlink()
    if kind == 1:
        path.mkdir()
    elif kind == 2:
        path.symlink_to(draw(st.sampled_from([path.name, "/dev/zero", "/nowhere", "/dev/null"])))
    elif kind == 3:
        os.mkfifo(path)
