import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from touchdown.agents.learners.backend import is_built
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import NetworkConfig
from touchdown.core import device
from touchdown.core.errors import UserError
from touchdown.policies import lookup

PROGRAM = (
    "from touchdown.core import device; device.start(); import jax;"
    "print(jax.config.jax_compilation_cache_dir); jax.jit(lambda x: x + 1)(1.0)"
)


def said(**environment: str) -> str:
    kept = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", PROGRAM],
        env={**kept, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stderr == ""
    return run.stdout.strip()


def test_a_fork_of_a_process_that_uses_jax_is_refused_before_it_hangs(monkeypatch):
    network = QNetwork(2, 1, NetworkConfig(hidden_sizes=(2,)))
    policy = network.policy(np.zeros(network.num_params, np.float32))
    policy.act(np.zeros((1, 2)))
    monkeypatch.setattr(device, "_started_in", [os.getppid()])  # as in a forked child
    for use in (
        lambda: policy.act(np.zeros((1, 2))),
        lambda: QNetwork(2, 1, NetworkConfig()),
        lambda: device.use("cpu"),
    ):
        with pytest.raises(UserError, match=r"^this process was forked after JAX had started, and"):
            use()
    for name in ("pid", "ace") if is_built() else ("pid",):  # they need no JAX
        assert lookup.load(name).policy.act(np.zeros((1, 8))).shape == (1,)


def test_compiled_code_is_kept_in_the_users_cache_and_found_again(tmp_path):
    folder = Path(said(XDG_CACHE_HOME=str(tmp_path)))
    assert folder.parent == tmp_path / "touchdown"
    kept = sorted(path.name for path in folder.iterdir() if "atime" not in path.name)
    assert kept
    assert said(XDG_CACHE_HOME=str(tmp_path)) == str(folder)
    assert sorted(path.name for path in folder.iterdir() if "atime" not in path.name) == kept


def test_a_cache_folder_that_the_user_chose_is_kept(tmp_path):
    chosen = tmp_path / "mine"
    chosen.mkdir()
    assert said(JAX_COMPILATION_CACHE_DIR=str(chosen)) == str(chosen)


def test_without_a_writable_cache_folder_nothing_is_kept_and_computing_works(tmp_path):
    taken = tmp_path / "file"
    taken.write_text("not a folder", "utf-8")
    assert said(XDG_CACHE_HOME=str(taken)) == "None"
