import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file

from touchdown.core import files

STUDY = """
base = "paper-best"
seeds = 2
[config.learning]
backend = "fused"
[config.network]
hidden_sizes = [32]
[config.training]
episodes = 100000
max_env_steps = 30000
checkpoint_seconds = 0.1
validation_period = 5000
validation_episodes = 5
final_validation_episodes = 5
test_episodes = 5
[[factor]]
field = "learning.gamma"
values = [0.95, 0.99]
"""
TIMED = {"seconds", "observations_per_second"}


def begin(study: Path, results: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "touchdown", "study", "run", str(study)]
    return subprocess.Popen(
        [*command, "--workers", "2", "--results-dir", str(results)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ},
    )


def untimed(rows):
    return [{name: row[name] for name in row if name not in TIMED} for row in rows]


def contents(results: Path):
    """All that runs have written, but for what a clock decides."""
    found = {}
    for run in sorted((results / "runs").iterdir()):
        found[run.name] = {
            "episodes": untimed(files.read_jsonl(run / "episodes.jsonl")),
            "validations": untimed(files.read_jsonl(run / "validations.jsonl")),
            "flights": json.loads((run / "evaluation.json").read_text())["pilots"][0]["episodes"],
            "last": json.loads((run / "last.json").read_text())["pilots"][0]["episodes"],
            "weights": {
                name: array.tobytes()
                for name, array in load_file(run / "checkpoints" / "best.safetensors").items()
            },
        }
    return found


def begun_and_done(results: Path) -> tuple[int, int]:
    runs = list(results.glob("runs/*"))
    return len(runs), sum((run / "evaluation.json").is_file() for run in runs)


@pytest.mark.slow
def test_a_study_killed_at_three_random_moments_equals_one_that_was_not(tmp_path):
    study = tmp_path / "small.toml"
    study.write_text(STUDY)
    began = time.monotonic()
    assert begin(study, tmp_path / "whole").wait() == 0
    whole = time.monotonic() - began
    rng = np.random.default_rng(0)
    unfinished = 0
    for _ in range(3):
        process = begin(study, tmp_path / "killed")
        time.sleep(rng.uniform(0.25, 0.45) * whole)
        unfinished += process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert unfinished >= 2  # or little was tried
    assert begin(study, tmp_path / "killed").wait() == 0
    assert begun_and_done(tmp_path / "killed") == (4, 4)
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")
