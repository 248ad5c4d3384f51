"""One rule for every output: what exists is refused before the work, unless the user forces it."""

import pytest

import touchdown
from command_line import complaint
from touchdown.config import presets
from touchdown.exports import source
from touchdown.runs import folder as folders

SAID = "exists already; choose another, or replace it with --force"


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A folder with a run, and with a file and a folder that nobody may replace."""
    monkeypatch.chdir(tmp_path)
    folders.create(tmp_path / "runs", presets.preset("pilot"), "run")
    (tmp_path / "file.toml").write_text("mine")
    (tmp_path / "film.gif").write_text("mine")
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "index.html").write_text("mine")
    return tmp_path


@pytest.mark.parametrize(
    "write",
    [
        lambda: touchdown.fly("pid", out="film.gif"),
        lambda: touchdown.export("ace", out="page"),
        lambda: touchdown.export("ace", out="file.toml"),
        lambda: touchdown.compare("run", out="page"),
        lambda: touchdown.tune_pid(out="file.toml"),
        lambda: touchdown.tune_agent("pilot", out="file.toml"),
    ],
)
def test_an_output_that_exists_is_refused_before_the_work(mine, write):
    with pytest.raises(touchdown.UserError, match=SAID):
        write()
    assert (mine / "file.toml").read_text() == "mine"
    assert (mine / "film.gif").read_text() == "mine"
    assert (mine / "page" / "index.html").read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("pid-0.gif", ["fly", "pid"]),
        ("pid.toml", ["tune", "pid"]),
        ("pilot-tuned.toml", ["tune", "agent", "pilot"]),
        ("comparison", ["compare", "run"]),
        ("ace-onnx", ["export", "ace"]),
    ],
)
def test_a_name_of_our_own_that_is_taken_is_refused_as_well(mine, name, words, capsys):
    (mine / name).write_text("mine")
    assert complaint(*words, capsys=capsys) == f"out {name!r}: {SAID}"
    assert (mine / name).read_text() == "mine"


def test_force_replaces_a_file_and_keeps_its_neighbours(mine):
    touchdown.tune_pid(starts=1, tolerance=0.99, out="file.toml", force=True)
    assert (mine / "file.toml").read_text().startswith("# touchdown tune pid")
    assert (mine / "film.gif").read_text() == "mine"


def test_force_replaces_an_export_and_keeps_what_else_is_in_its_folder(mine, monkeypatch):
    # the card of a shipped policy has its test, here of a single start, and a film
    monkeypatch.setattr(source, "TEST_STARTS", source.TEST_STARTS[:1])
    monkeypatch.setattr(source.films, "write_gif", lambda _, path, *__: path.write_bytes(b"film"))
    exported = touchdown.export("ace", "safetensors", out="page", force=True)
    assert exported.files[0].is_file()
    assert (mine / "page" / "index.html").read_text() == "mine"
