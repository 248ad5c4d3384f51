"""What a command loads before it knows that it has work: every second of it is a wait."""

import subprocess
import sys

import pytest

from touchdown.agents.learners.backend import is_built

_HEAVY = {"jax", "scipy.stats", "matplotlib", "optuna", "onnxruntime", "ray"}
_REFUSED = (
    "train pilot --seed -1",
    "train --env-id LunarLandr-v3",
    "train --resume nope",
    "evaluate nope",
    "evaluate pid --episodes 0",
    "fly ace --out x.avi",
    "export nope",
    "compare nope",
    "show nope",
    "watch nope",
    "fly nope --over-training",
    "tune pid --out nope/x.toml",
    "tune agent pilto",
    "study run nope.toml",
    "study status",
    "study report",
)
_ANSWERED = ("--version", "--help", "train swift --help", "presets", "study list", "runs")
_FUSED = (
    "evaluate ace --episodes 1",
    "train swift --name x --max-env-steps 2000 --no-stop-when-solved --test-episodes 0",
    "train pilot --name y --max-env-steps 2000 --test-episodes 0 --final-validation-episodes 2",
)
_PROGRAM = """
import sys
from touchdown.cli import app
heavy, *commands = sys.argv[1:]
for words in commands:
    try:
        app.main(words.split())
    except SystemExit:
        pass
    loaded = set(heavy.split()) & set(sys.modules)
    assert not loaded, f"touchdown {words} loads {loaded}"
"""


def run(tmp_path, heavy: set[str], commands: tuple[str, ...]) -> "subprocess.CompletedProcess[str]":
    """Run commands in one process, which fails if one of them loads a heavy library."""
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", _PROGRAM, " ".join(heavy), *commands],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended


@pytest.mark.skipif(not is_built(), reason="the kernel was not built")
def test_what_the_fused_kernel_computes_loads_no_jax(tmp_path):
    ended = run(tmp_path, {"jax", "optax", "equinox"}, _FUSED)
    assert "touchdown: " not in ended.stderr
    assert {path.name for path in (tmp_path / "runs").iterdir()} == {"x", "y"}


def test_a_refusal_or_a_listing_loads_no_heavy_library(tmp_path):
    (tmp_path / "runs").mkdir()
    ended = run(tmp_path, _HEAVY, (*_REFUSED, *_ANSWERED))
    said = [line for line in ended.stderr.splitlines() if line.startswith("touchdown: ")]
    assert len(said) == len(_REFUSED), ended.stderr
