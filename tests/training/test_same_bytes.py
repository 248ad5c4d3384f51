"""One seed gives the same bytes on one machine, whatever else it does."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest

from small_configs import tiny
from touchdown.config.config import Config
from touchdown.core import files
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.training.trainer import Trainer

# what the wall clock decides
CLOCK = {"seconds", "solved_seconds"}
TRAIN = """
import sys, touchdown
from dataclasses import replace
from touchdown.config.presets import preset
config = preset("swift")
training = replace(
    config.training,
    max_env_steps=20_000,
    stop_when_solved=False,
    final_validation_episodes=16,
    test_episodes=4,
)
touchdown.train(replace(config, training=training), name="run", runs_dir=sys.argv[1])
"""
# JAX has already started, without our flags, and computes on all cores
STARTED = "import jax; jax.numpy.ones(3) + 1\n"
BUSY = "while True: pass"


def digest_of(folder: RunFolder) -> str:
    """SHA-256 of a run's weights and records, without what the wall clock decides."""
    digest = hashlib.sha256()
    for name, tensor in sorted(files.read_tensors(folder.best)[0].items()):
        digest.update(name.encode() + tensor.tobytes())
    for path in (folder.episodes, folder.updates, folder.validations):
        rows = ({k: v for k, v in row.items() if k not in CLOCK} for row in files.read_jsonl(path))
        digest.update(json.dumps(list(rows)).encode())
    if folder.evaluation.is_file():
        digest.update(json.dumps(json.loads(folder.evaluation.read_text())["pilots"]).encode())
    return digest.hexdigest()


@pytest.mark.parametrize("backend", ["fused", pytest.param("jax", marks=pytest.mark.slow)])
def test_one_thread_or_several_train_the_same(tmp_path, monkeypatch, backend):
    base = tiny(num_envs=70, max_env_steps=2_100, validation_period=1_000)
    config: Config = replace(base, learning=replace(base.learning, backend=backend))
    digests = []
    for threads in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        folder = folders.create(tmp_path, config, f"threads-{threads}")
        trainer = Trainer(folder)
        trainer.run()
        trainer.close()
        digests.append(digest_of(folder))
    assert digests[0] == digests[1]


def trained(runs_dir: Path, program: str, environment: Mapping[str, str]) -> str:
    done = subprocess.run(
        [sys.executable, "-c", program, str(runs_dir)],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return digest_of(RunFolder(runs_dir / "run"))


@pytest.mark.slow  # trains four times, each in a process of its own
def test_swift_trains_the_same_under_load_and_with_any_number_of_threads(tmp_path):
    digests = {
        "one thread": trained(tmp_path / "one", TRAIN, {"OMP_NUM_THREADS": "1"}),
        "two threads": trained(tmp_path / "two", TRAIN, {"OMP_NUM_THREADS": "2"}),
        "JAX with all cores": trained(tmp_path / "all", STARTED + TRAIN, {"OMP_NUM_THREADS": "1"}),
    }
    with ExitStack() as load:
        for _ in range(os.cpu_count() or 1):
            busy = subprocess.Popen([sys.executable, "-c", BUSY])
            load.callback(busy.wait)
            load.callback(busy.kill)
        digests["under load"] = trained(tmp_path / "load", TRAIN, {"OMP_NUM_THREADS": "2"})
    assert set(digests.values()) == {digests["one thread"]}, digests
