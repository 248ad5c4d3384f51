"""The frame of a snapshot: what it is of, its version, and a digest of all its bytes."""

import hashlib
import struct

_VERSION = 2
_HEADER = struct.Struct("<8sI8s")  # magic, version, digest


def seal(magic: bytes, content: bytes) -> bytes:
    """A snapshot with this content.

    Args:
        magic: 8 bytes that say what the snapshot is of.
        content: the state.
    """
    return _HEADER.pack(magic, _VERSION, _digest(content)) + content


def unseal(magic: bytes, snapshot: bytes, what: str) -> bytes:
    """The content that was given to `seal`.

    Args:
        magic: the 8 bytes that were given to `seal`.
        snapshot: the bytes, from any source.
        what: description of what the snapshot must be of, for the error message.

    Raises:
        ValueError: the bytes are something else, of another version, or damaged.
    """
    if len(snapshot) < _HEADER.size or not snapshot.startswith(magic):
        raise ValueError(f"not a snapshot of {what}")
    _, version, digest = _HEADER.unpack_from(snapshot)
    if version != _VERSION:
        raise ValueError(f"snapshot version {version}: must be {_VERSION}")
    content = bytes(snapshot[_HEADER.size :])
    if digest != _digest(content):
        raise ValueError("the snapshot is damaged")
    return content


def _digest(content: bytes) -> bytes:
    """It detects accidents; it is no defence against intent."""
    return hashlib.blake2b(content, digest_size=8).digest()
