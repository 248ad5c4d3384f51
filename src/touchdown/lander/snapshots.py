"""A snapshot's envelope: what it is of, its version, and a digest of all that it holds."""

from hashlib import blake2b

SNAPSHOT_VERSION = 2
_MAGIC_BYTES, _VERSION_BYTES, _DIGEST_BYTES = 8, 4, 16
_ENVELOPE_BYTES = _MAGIC_BYTES + _VERSION_BYTES + _DIGEST_BYTES


def seal(magic: bytes, content: bytes) -> bytes:
    """Put the content of a snapshot into its envelope.

    Args:
        magic: 8 bytes that say what the snapshot is of.
        content: any bytes.
    """
    return _head(magic) + _digest(magic, content) + content


def unseal(magic: bytes, snapshot: bytes) -> bytes:
    """The content of a snapshot that `seal` made.

    The digest detects accidents, and is no defence against intent.

    Args:
        magic: as given to `seal`.
        snapshot: bytes from anywhere.

    Raises:
        ValueError: they are of something else, of another version, or any bit has changed.
    """
    if snapshot[:_MAGIC_BYTES] != magic:
        raise ValueError("not a snapshot of such a lander")
    version = int.from_bytes(snapshot[_MAGIC_BYTES : _MAGIC_BYTES + _VERSION_BYTES], "little")
    if version != SNAPSHOT_VERSION:
        raise ValueError(f"snapshot version {version}: must be {SNAPSHOT_VERSION}")
    content = snapshot[_ENVELOPE_BYTES:]
    if snapshot[len(_head(magic)) : _ENVELOPE_BYTES] != _digest(magic, content):
        raise ValueError("the snapshot is damaged")
    return content


def _head(magic: bytes) -> bytes:
    return magic + SNAPSHOT_VERSION.to_bytes(_VERSION_BYTES, "little")


def _digest(magic: bytes, content: bytes) -> bytes:
    return blake2b(magic + content, digest_size=_DIGEST_BYTES).digest()
