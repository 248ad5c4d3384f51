"""An untrusted zip archive: read in memory, never unpacked to disk, with limits on sizes."""

import io
import struct
import zipfile
import zlib

from touchdown.core import limits

_READABLE = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENTRY = b"PK\x01\x02"  # begins each entry of the directory
_ENCRYPTED = 0x1  # of a member's flags
_BROKEN = (
    zipfile.BadZipFile,
    EOFError,
    NotImplementedError,  # a feature of zip that Python does not support
    OSError,  # an offset before the beginning
    OverflowError,
    RuntimeError,
    struct.error,
    ValueError,
    zlib.error,
)


class Archive:
    """The members of a zip archive, by name.

    Names are only compared, never used as paths.

    Args:
        data: the whole archive.

    Raises:
        ValueError: it is not a zip archive, or has too many members.
    """

    def __init__(self, data: bytes) -> None:
        entries = data.count(_ENTRY)  # before any is read: each takes much memory
        if entries > limits.ARCHIVE_MEMBERS:
            raise ValueError(f"has {entries} members, must be at most {limits.ARCHIVE_MEMBERS}")
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
            self._members = {member.filename: member for member in self._zip.infolist()}
        except _BROKEN:
            raise ValueError("not a complete zip archive") from None

    @property
    def names(self) -> list[str]:
        """The names of the members."""
        return list(self._members)

    def read(self, name: str, most: int) -> bytes:
        """The bytes of a member.

        Args:
            name: name of the member.
            most: limit on its uncompressed size in bytes.

        Raises:
            ValueError: there is no such member, or it is larger, broken, encrypted, or compressed
                with a method other than deflate.
        """
        if name not in self._members:
            raise ValueError(f"has no {name!r}")
        member = self._members[name]
        if member.file_size > most:
            raise ValueError(f"{name!r} has {member.file_size} bytes, must be at most {most}")
        if member.flag_bits & _ENCRYPTED or member.compress_type not in _READABLE:
            raise ValueError(f"{name!r} is encrypted, or its compression is not deflate")
        try:
            with self._zip.open(member) as file:
                data = file.read(most + 1)  # the size checked above is only what the archive claims
        except _BROKEN:
            data = b""
        if len(data) != member.file_size:
            raise ValueError(f"{name!r} is truncated or altered")
        return data
