import errno
from pathlib import Path

import pytest

from touchdown.core import files, temporaries


def disk_full(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def leave(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a killed writer leaves, of a file and of a folder: a kill runs no clean-up."""
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", lambda *_, **__: None)
        patch.setattr(temporaries.shutil, "rmtree", lambda *_, **__: None)
        patch.setattr(files.os, "fsync", disk_full)
        with pytest.raises(OSError, match="No space left"):
            files.write_atomic(folder / "film.gif", b"half")
        with pytest.raises(OSError, match="No space left"):
            files.write_folder_atomic(folder / "ten", lambda at: (at / "a").write_text("half"))


def test_what_killed_writers_left_is_removed_and_nothing_else(tmp_path, monkeypatch):
    leave(tmp_path, monkeypatch)
    (tmp_path / ".config.1.tmp.toml").write_text("as former versions named it")
    assert len(list(tmp_path.iterdir())) == 3
    kept = ["state.json", ".hidden", "notes.tmp", ".notes.tmp", "folder"]
    for name in kept[:-1]:
        (tmp_path / name).write_text("mine")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / ".deeper.1.tmp").write_text("in a folder that was not named")

    temporaries.remove_temporaries([tmp_path, tmp_path / "not there"])

    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(kept)
    assert (tmp_path / "folder" / ".deeper.1.tmp").exists()


@pytest.mark.parametrize("write", [files.write_atomic, files.write_folder_atomic])
def test_the_next_writer_in_a_folder_tidies_up(tmp_path, monkeypatch, write):
    leave(tmp_path, monkeypatch)
    write(tmp_path / "other", b"x" if write is files.write_atomic else lambda _: None)
    assert [path.name for path in tmp_path.iterdir()] == ["other"]


def test_a_writer_at_work_keeps_its_file_and_its_folder(tmp_path):
    def write(folder: Path) -> None:
        files.write_through(tmp_path / "b.gif", lambda at: (at.write_text("b"), tidy()))
        (folder / "c").write_text("c")
        tidy()

    def tidy() -> None:
        temporaries.remove_temporaries([tmp_path])

    files.write_folder_atomic(tmp_path / "a", write)
    assert (tmp_path / "b.gif").read_text() == "b"
    assert (tmp_path / "a" / "c").read_text() == "c"


def test_a_link_at_the_name_of_a_temporary_file_is_not_followed(tmp_path, monkeypatch):
    (tmp_path / "thesis").write_text("mine")
    names = iter(["taken", "taken", "free", "taken", "open"])
    monkeypatch.setattr(temporaries.secrets, "token_hex", lambda _: next(names))
    monkeypatch.setattr(temporaries, "remove_temporaries", lambda _: None)
    for name in (".a.0-taken.tmp", ".f.0-taken.tmp"):
        (tmp_path / name).symlink_to("thesis")
    monkeypatch.setattr(temporaries.os, "getpid", lambda: 0)
    files.write_atomic(tmp_path / "a", "new")
    files.write_folder_atomic(tmp_path / "f", lambda at: (at / "b").write_text("new"))
    assert (tmp_path / "thesis").read_text() == "mine"
    assert (tmp_path / "a").read_text() == (tmp_path / "f" / "b").read_text() == "new"


def test_two_writers_of_one_file_do_not_meet(tmp_path):
    path = tmp_path / "a"
    files.write_through(path, lambda at: (at.write_text("outer"), files.write_atomic(path, "in")))
    assert path.read_text() == "outer"
    assert list(tmp_path.iterdir()) == [path]
