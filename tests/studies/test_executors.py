import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from chores import Chore

from touchdown.core.errors import Interrupted, UserError
from touchdown.studies import store as stores
from touchdown.studies.executors import LocalExecutor
from touchdown.studies.runner import run_jobs

HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def chores_for_workers(monkeypatch):
    # workers are fresh processes: they find the chores as this one does
    monkeypatch.setenv("PYTHONPATH", str(HERE))


@pytest.fixture
def store(tmp_path):
    return stores.open_store(tmp_path / "results", make=True)


def attempts_of(store, name: str) -> int:
    return len((store.runs / name / "attempts").read_text())


def test_every_job_is_done_once_and_progress_is_told(store):
    events = []
    jobs = [Chore(f"job-{i}") for i in range(5)]
    state = run_jobs(
        jobs, store, LocalExecutor(2), on_state=lambda _state, event: events.append(event)
    )
    assert (state.total, state.done, state.failed, state.died) == (5, 5, {}, 0)
    assert all(attempts_of(store, job.name) == 1 for job in jobs)
    assert {event.kind for event in events} >= {"started", "advanced", "done"}
    assert not list((store.path / "logs").iterdir())


def test_what_is_done_is_not_done_again(store):
    run_jobs([Chore("a")], store, LocalExecutor(1))
    state = run_jobs([Chore("a"), Chore("b"), Chore("b")], store, LocalExecutor(1))
    assert (state.total, state.done) == (2, 2)
    assert attempts_of(store, "a") == attempts_of(store, "b") == 1


def test_a_worker_that_dies_has_its_job_gone_on_with(store):
    jobs = [Chore("mortal", "die", until=5, times=2), Chore("other")]
    state = run_jobs(jobs, store, LocalExecutor(2))
    assert (state.done, state.failed, state.died) == (2, {}, 2)
    assert attempts_of(store, "mortal") == 3
    # it went on from 2 and did not count anew
    assert (store.runs / "mortal" / "count").read_text() == "5"


def test_a_job_whose_workers_always_die_is_named_and_the_others_go_on(store):
    jobs = [Chore("doomed", "die", until=99, times=99), *(Chore(f"job-{i}") for i in range(3))]
    state = run_jobs(jobs, store, LocalExecutor(2))
    assert state.done == 3
    assert attempts_of(store, "doomed") == 3
    assert "its worker died (exit code -9)" in state.failed["doomed"]
    assert "doomed.log, 3 times" in state.failed["doomed"]
    assert store.failed() == state.failed


def test_a_worker_that_is_killed_while_it_waits_is_replaced(store):
    children = multiprocessing.active_children
    killed = []

    def kill_the_idle(_state, event) -> None:
        if event.kind == "done" and not killed:
            killed.extend(children())
            for each in killed:
                each.kill()
                each.join()

    jobs = [Chore("a"), Chore("b")]
    state = run_jobs(jobs, store, LocalExecutor(1), on_state=kill_the_idle)
    assert len(killed) == 1
    assert (state.done, state.failed) == (2, {})


def test_a_folder_that_was_moved_stops_all_with_one_line(store):
    moved = store.path.with_name("moved")

    def move(_state, event) -> None:
        if event.kind == "done" and not moved.exists():
            store.path.rename(moved)

    with pytest.raises(UserError, match=r"runs: cannot be written: No such file or directory"):
        run_jobs([Chore("a"), Chore("b")], store, LocalExecutor(1), on_state=move)
    assert not store.path.exists()
    assert (moved / "runs" / "a" / "done").is_file()


def test_a_job_that_is_refused_is_not_tried_again(store):
    state = run_jobs([Chore("bad", "refuse"), Chore("good")], store, LocalExecutor(1))
    assert state.failed == {"bad": "gamma = 7: must be from 0 to 1"}
    assert attempts_of(store, "bad") == 1
    assert state.done == 1


def test_what_nobody_thought_of_is_in_the_log(store):
    state = run_jobs([Chore("odd", "raise")], store, LocalExecutor(1))
    assert "RuntimeError: what nobody thought of" in state.failed["odd"]
    assert "Traceback" in (store.path / "logs" / "odd.log").read_text()
    assert attempts_of(store, "odd") == 3


def test_a_full_disk_stops_all_with_one_line(store):
    with pytest.raises(UserError, match=r"count: cannot be written: No space left on device"):
        run_jobs([Chore("full", "full"), Chore("b", seconds=0.2)], store, LocalExecutor(2))


def test_stopping_saves_what_is_under_way(store):
    jobs = [Chore("long", until=1_000, seconds=0.02)]
    began = time.monotonic()
    with pytest.raises(Interrupted):
        run_jobs(jobs, store, LocalExecutor(1), should_stop=lambda: time.monotonic() - began > 4)
    count = int((store.runs / "long" / "count").read_text())
    assert 0 < count < 1_000
    assert not jobs[0].is_done(store.runs)
    # the process has stopped counting
    time.sleep(0.3)
    assert int((store.runs / "long" / "count").read_text()) == count


def test_workers_end_with_whoever_started_them(store):
    script = (
        "from chores import Chore\n"
        "from pathlib import Path\n"
        "from touchdown.studies import store as stores\n"
        "from touchdown.studies.executors import LocalExecutor\n"
        "from touchdown.studies.runner import run_jobs\n"
        "if __name__ == '__main__':\n"
        f"    store = stores.open_store(Path({str(store.path)!r}))\n"
        "    run_jobs([Chore('long', until=10_000, seconds=0.01)], store, LocalExecutor(1))\n"
    )
    path = store.path.parent / "parent.py"
    path.write_text(script)
    parent = subprocess.Popen([sys.executable, str(path)], env={**os.environ})
    counted = store.runs / "long" / "count"
    until = time.monotonic() + 240
    while not counted.is_file() and time.monotonic() < until:
        time.sleep(0.05)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    time.sleep(0.5)
    count = counted.read_text()
    time.sleep(0.5)
    assert counted.read_text() == count


def test_a_number_of_workers_that_cannot_be_is_refused():
    with pytest.raises(UserError, match="workers = 0: must be from 1"):
        LocalExecutor(0)
