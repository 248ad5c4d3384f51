"""What a command loads before it knows that it has work: every second of it is a wait."""

import subprocess
import sys

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
    "tune pid --out nope/x.toml",
    "tune agent pilto",
    "study run nope.toml",
    "study status",
    "study report",
)
_ANSWERED = ("--version", "--help", "train swift --help", "presets", "study list", "runs")
_PROGRAM = f"""
import sys
from touchdown.cli import app
for words in sys.argv[1:]:
    try:
        app.main(words.split())
    except SystemExit:
        pass
    loaded = {_HEAVY!r} & set(sys.modules)
    assert not loaded, f"touchdown {{words}} loads {{loaded}}"
"""


def test_a_refusal_or_a_listing_loads_no_heavy_library(tmp_path):
    (tmp_path / "runs").mkdir()
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", _PROGRAM, *_REFUSED, *_ANSWERED],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    said = [line for line in ended.stderr.splitlines() if line.startswith("touchdown: ")]
    assert len(said) == len(_REFUSED), ended.stderr
