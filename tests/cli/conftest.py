"""A finished run for the verbs that take one."""

from pathlib import Path

import pytest

from command_line import SHORT, run


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of runs with one finished run in it, `cart`."""
    runs = tmp_path_factory.mktemp("cli") / "runs"
    done = run("train", "dqn", *SHORT, "--episodes=8", "--name=cart", f"--runs-dir={runs}")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "CartPole-v1: 3 greedy episodes from starts 0-2" in done.stdout
    return runs
