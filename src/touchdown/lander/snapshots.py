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


def unseal(magic: bytes, snapshot: bytes, least: int) -> bytes:
    """The content of a snapshot that `seal` made.

    The digest detects accidents, and is no defence against intent.

    Args:
        magic: as given to `seal`.
        snapshot: bytes from anywhere.
        least: bytes that the content has at least.

    Raises:
        ValueError: they are of something else, of another version, or any bit has changed.
    """
    if snapshot[:_MAGIC_BYTES] != magic:
        raise ValueError("not a snapshot of such a lander")
    version = int.from_bytes(snapshot[_MAGIC_BYTES : _MAGIC_BYTES + _VERSION_BYTES], "little")
    if version != SNAPSHOT_VERSION:
        raise ValueError(f"snapshot version {version}: must be {SNAPSHOT_VERSION}")
    content = snapshot[_ENVELOPE_BYTES:]
    digest = snapshot[_MAGIC_BYTES + _VERSION_BYTES : _ENVELOPE_BYTES]
    if digest != _digest(magic, content) or len(content) < least:
        raise ValueError("the snapshot is damaged")
    return content


def check_steps(steps: int, limit: int) -> None:
    """Raise if an environment with a time limit cannot have taken so many steps.

    Raises:
        ValueError: the step count of a snapshot is not from 0 to the limit.
    """
    if not 0 <= steps <= limit:
        raise ValueError(f"the snapshot has {steps} steps, must be from 0 to {limit}")


def _head(magic: bytes) -> bytes:
    return magic + SNAPSHOT_VERSION.to_bytes(_VERSION_BYTES, "little")


def _digest(magic: bytes, content: bytes) -> bytes:
    return blake2b(magic + content, digest_size=_DIGEST_BYTES).digest()
