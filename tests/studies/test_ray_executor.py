import os
import secrets
import subprocess
import sys
import time
from pathlib import Path

import pytest
from chores import Chore

from touchdown.core.errors import UserError
from touchdown.studies import store as stores
from touchdown.studies.executors import LocalExecutor
from touchdown.studies.plan import Factor, Study, levels_of
from touchdown.studies.results import read_study
from touchdown.studies.runner import jobs_of, run_jobs

ray = pytest.importorskip("ray")
RayExecutor = pytest.importorskip("touchdown.studies.ray_executor").RayExecutor
Cluster = pytest.importorskip("ray.cluster_utils").Cluster
authentication = pytest.importorskip("ray._private.authentication_test_utils")
pytestmark = [
    pytest.mark.slow,
    # Ray's own: its sockets and processes are still there when the interpreter looks
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::FutureWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
HERE = Path(__file__).parent


@pytest.fixture
def cluster(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(HERE))
    monkeypatch.setenv("RAY_AUTH_MODE", "token")
    monkeypatch.setenv("RAY_AUTH_TOKEN", secrets.token_hex(32))
    authentication.reset_auth_token_state()  # it was read when Ray was imported
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    ray.init(address=cluster.address, log_to_driver=False, logging_level="ERROR")
    yield cluster
    ray.shutdown()
    cluster.shutdown()


@pytest.fixture
def store(tmp_path):
    return stores.open_store(tmp_path / "results", make=True)


def tiny() -> Study:
    return Study(
        name="tiny",
        base="cartpole",
        seeds=2,
        changes={
            "training": {
                "max_env_steps": 6_000,
                "validation_period": 2_000,
                "validation_episodes": 3,
                "final_validation_episodes": 3,
                "test_episodes": 4,
                "checkpoint_seconds": 0.0,
            },
            "replay": {"min_size": 200},
        },
        factors=(Factor("γ", levels_of("learning.gamma", [0.9, 0.99])),),
    )


@pytest.mark.usefixtures("cluster")
def test_jobs_are_done_and_their_files_come_back(store):
    jobs = [Chore(f"job-{i}") for i in range(3)]
    state = run_jobs([*jobs, Chore("bad", "refuse")], store, RayExecutor())
    assert (state.done, state.failed) == (3, {"bad": "gamma = 7: must be from 0 to 1"})
    assert all(job.is_done(store.runs) for job in jobs)


def test_a_study_that_loses_a_node_ends_complete_and_equal_to_a_local_one(cluster, tmp_path):
    study = tiny()
    far, near = (stores.open_store(tmp_path / name, make=True) for name in ("far", "near"))
    node = cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()
    killed = []

    def kill_once(state, event) -> None:
        if not killed and len(state.running) == 2 and event.kind == "advanced":
            killed.append(time.monotonic())
            cluster.remove_node(node, allow_graceful=False)

    state = run_jobs(jobs_of([(study, 2)]), far, RayExecutor(), on_state=kill_once)
    assert killed
    assert (state.done, state.failed) == (4, {})
    run_jobs(jobs_of([(study, 2)]), near, LocalExecutor(2))

    def numbers(store):
        table = read_study(study, 2, store).table()
        return table.drop("seconds", "seconds_to_solved").sort("run").to_dicts()

    assert numbers(far) == numbers(near)


def test_a_cluster_with_a_token_refuses_those_who_do_not_have_it(cluster):
    script = (
        f"from touchdown.studies.ray_executor import RayExecutor; RayExecutor({cluster.address!r})"
    )
    for mode in ("disabled", "token"):
        done = subprocess.run(
            [sys.executable, "-c", script],
            env={**os.environ, "RAY_AUTH_MODE": mode, "RAY_AUTH_TOKEN": "0" * 64},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 1
        assert "no cluster can be reached" in done.stderr
        assert "check that it runs, and that this machine has its token" in done.stderr


def test_a_cluster_that_cannot_be_reached_is_named():
    assert "RAY_ADDRESS" not in os.environ
    with pytest.raises(UserError, match=r"ray://127\.0\.0\.1:9: no cluster|no cluster can be"):
        RayExecutor("ray://127.0.0.1:9")
