import io
import zipfile

import pytest

from touchdown.policies.foreign.archive import Archive


def zipped(members: dict[str, bytes], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return file.getvalue()


@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_a_member_is_read_as_it_was_written(compression):
    archive = Archive(zipped({"a": b"one", "b/c": b""}, compression))
    assert archive.names == ["a", "b/c"]
    assert archive.read("a", 3) == b"one"
    assert archive.read("b/c", 0) == b""


def test_a_member_larger_than_the_limit_is_not_decompressed():
    bomb = zipped({"a": bytes(1_000_000)})
    assert len(bomb) < 2_000
    with pytest.raises(ValueError, match="'a' has 1000000 bytes, must be at most 999999"):
        Archive(bomb).read("a", 999_999)


def test_a_member_that_understates_its_size_is_refused():
    data = zipped({"a": bytes(1_000_000)})
    lying = data.replace((1_000_000).to_bytes(4, "little"), (10).to_bytes(4, "little"))
    assert lying != data
    with pytest.raises(ValueError, match="'a' is truncated or altered"):
        Archive(lying).read("a", 100)


def test_a_member_name_is_never_used_as_a_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    archive = Archive(zipped({"../up": b"1", "/abs": b"2"}))
    assert archive.read("../up", 9) == b"1"
    with pytest.raises(ValueError, match="has no 'up'"):
        archive.read("up", 9)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_compression_methods_are_refused(compression):
    with pytest.raises(ValueError, match="its compression is not deflate"):
        Archive(zipped({"a": b"one"}, compression)).read("a", 9)


def test_an_encrypted_member_is_refused():
    data = bytearray(zipped({"a": b"one"}, zipfile.ZIP_STORED))
    data[data.index(b"PK\x01\x02") + 8] |= 1  # the flags in the directory
    with pytest.raises(ValueError, match="'a' is encrypted"):
        Archive(bytes(data)).read("a", 9)


def test_an_altered_member_is_refused():
    data = zipped({"a": b"one"}, zipfile.ZIP_STORED).replace(b"one", b"two")
    with pytest.raises(ValueError, match="'a' is truncated or altered"):
        Archive(data).read("a", 9)


def test_too_many_members_are_refused():
    with pytest.raises(ValueError, match="has 10001 members, must be at most 10000"):
        Archive(zipped({str(number): b"" for number in range(10_001)}))


@pytest.mark.parametrize("data", [b"", b"PK\x05\x06", b"text" * 10])
def test_data_that_is_not_an_archive_is_refused(data):
    with pytest.raises(ValueError, match="not a complete zip archive"):
        Archive(data)
