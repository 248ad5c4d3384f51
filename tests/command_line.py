"""The command line as tests start it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from touchdown.cli import app

SHORT = [
    "--env-id=CartPole-v1",
    "--hidden-sizes=8",
    "--min-size=20",
    "--validation-period=100",
    "--validation-episodes=2",
    "--final-validation-episodes=2",
    "--test-episodes=3",
]


def run(*args: str, cwd: Path | None = None, **env: str) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own, as a person starts it."""
    return subprocess.run(
        [sys.executable, "-m", "touchdown", *args],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=os.environ | env,
        timeout=300,
        check=False,
    )


def complaint(*args: str, capsys: pytest.CaptureFixture[str]) -> str:
    """The one line of a refused command."""
    with pytest.raises(SystemExit) as stop:
        app.main(args)
    assert stop.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    lines = said.err.splitlines()
    assert len(lines) == 1, said.err
    assert lines[0].startswith("touchdown: ")
    return lines[0].removeprefix("touchdown: ")
