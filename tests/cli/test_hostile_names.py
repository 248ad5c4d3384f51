"""A run in a folder whose name is no text and would control a terminal: every verb takes it."""

import os
import shutil

import pytest

from touchdown.cli import app

NAME = os.fsdecode(b"\xff\x1b[31mx")


@pytest.mark.parametrize(
    "words",
    [
        ["runs"],
        ["runs", "--json"],
        ["show", NAME],
        ["evaluate", NAME, "--episodes=1"],
        ["evaluate", NAME, "--episodes=1", "--json"],
        ["fly", NAME, "--out", os.fsdecode(b"\xfe.gif")],
        ["export", NAME, "--format=safetensors"],
        ["compare", NAME, "cart"],
    ],
    ids=lambda words: " ".join(words).replace(NAME, "NAME").encode("ascii", "replace").decode(),
)
def test_a_folder_named_with_any_bytes_works_and_shows_no_control_character(
    finished, tmp_path, monkeypatch, capsys, words
):
    monkeypatch.chdir(tmp_path)
    for name in ("cart", NAME):
        shutil.copytree(finished / "cart", tmp_path / "runs" / name)
    app.main(words)
    said = capsys.readouterr()
    assert said.err == ""
    said.out.encode()  # no byte that is no text
    assert "\x1b" not in said.out
