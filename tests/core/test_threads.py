"""How many threads a process uses."""

import os

import pytest

from touchdown.core import threads
from touchdown.envs.pool import make_pool


@pytest.fixture
def environ(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    # set, then removed: so monkeypatch undoes what a test sets even if nothing was set before
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    monkeypatch.delenv("OMP_NUM_THREADS")
    return monkeypatch


@pytest.mark.usefixtures("environ")
def test_a_process_uses_all_cores_that_it_may_run_on():
    assert threads.threads() == threads.available() == len(os.sched_getaffinity(0))


@pytest.mark.parametrize(("text", "count"), [("1", 1), ("3", 3), ("64", 64)])
def test_a_process_uses_as_many_threads_as_omp_num_threads_says(environ, text: str, count: int):
    environ.setenv("OMP_NUM_THREADS", text)
    assert threads.threads() == count


@pytest.mark.parametrize("text", ["", "0", "-2", "4,2", "all"])
def test_a_value_that_is_not_a_count_of_threads_is_ignored(environ, text: str):
    environ.setenv("OMP_NUM_THREADS", text)
    assert threads.threads() == threads.available()


def test_processes_that_are_started_use_one_thread_each(environ):
    del environ
    with threads.one_thread_each():
        assert threads.threads() == 1
    assert threads.threads() == threads.available()


def test_a_number_of_threads_that_is_already_set_is_kept(environ):
    environ.setenv("OMP_NUM_THREADS", "5")
    with threads.one_thread_each():
        assert threads.threads() == 5


def test_landers_are_split_between_threads_only_if_there_are_enough_of_them(environ):
    engine = pytest.importorskip("touchdown.lander._engine")
    asked: list[tuple[int, int]] = []

    def batch(count: int, *, num_threads: int) -> None:
        asked.append((count, num_threads))

    environ.setattr(engine, "Batch", batch)
    environ.setenv("OMP_NUM_THREADS", "4")
    for count in (1, 64, 65, 128, 1_000):
        make_pool("LunarLander-v3", count, "exact")
    assert asked == [(1, 1), (64, 1), (65, 2), (128, 2), (1_000, 4)]
