"""The overhead of a study: the same runs back to back and as a study.

    python benchmarks/study_overhead.py --runs 8 --rounds 2

Back to back: one process per worker with one thread, each with a share of the runs in a plain
loop from training to the last test episode. As a study: the same runs, assigned by the study's
runner to the same number of workers. The two take turns on one machine, each in new folders; the
start and the imports of the processes are included on both sides.
"""

import argparse
import multiprocessing
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from touchdown.core import threads
from touchdown.runs.provenance import cpu_name
from touchdown.studies import paper, runner
from touchdown.studies import store as stores
from touchdown.studies.executors import LocalExecutor
from touchdown.studies.store import Store
from touchdown.studies.work import TrainJob

Way = Callable[[Sequence[TrainJob], int, Store], None]


def jobs_of(runs: int, env_steps: int) -> list[TrainJob]:
    """Runs of the paper's best agent at the quick scale, with seeds that no study reports."""
    cells = paper.studies("quick")["ladder"].cells()
    config = next(cell.config for cell in cells if cell.labels == (paper.BEST,))
    training = replace(config.training, max_env_steps=env_steps)
    return [
        TrainJob(replace(config, seed=20_000 + seed, training=training)) for seed in range(runs)
    ]


def do_all(jobs: Sequence[TrainJob], store: Path) -> None:
    """Run jobs one after the other in this process."""
    for job in jobs:
        job.perform(store, lambda: False, lambda _: None)


def back_to_back(jobs: Sequence[TrainJob], workers: int, store: Store) -> None:
    """Run jobs in plain processes."""
    context = multiprocessing.get_context("spawn")
    with threads.one_thread_each():
        processes = [
            context.Process(target=do_all, args=(jobs[first::workers], store.runs))
            for first in range(workers)
        ]
        for process in processes:
            process.start()
        for process in processes:
            process.join()


def as_study(jobs: Sequence[TrainJob], workers: int, store: Store) -> None:
    """Run jobs with the study's runner."""
    runner.run_jobs(jobs, store, LocalExecutor(workers))


def seconds_of(way: Way, jobs: Sequence[TrainJob], workers: int) -> float:
    """Wall-clock seconds of all runs, in a new folder."""
    with tempfile.TemporaryDirectory() as name:
        store = stores.open_store(Path(name) / "results", make=True)
        began = time.perf_counter()
        way(jobs, workers, store)
        seconds = time.perf_counter() - began
        if missing := store.missing(jobs):
            raise SystemExit(f"{len(missing)} runs did not finish")
    return seconds


def main() -> None:
    """Take turns and print both times."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--workers", type=int, default=threads.available())
    names = ("--env-steps", "--observations")  # the second is the former name
    parser.add_argument(*names, type=int, default=40_000, help="of a run")
    args = parser.parse_args()
    print(
        f"{cpu_name()}, {os.cpu_count()} cores; {args.runs} runs of {args.env_steps:,} "
        f"env steps by {args.workers} workers",
        flush=True,
    )
    jobs = jobs_of(args.runs, args.env_steps)
    ratios: list[float] = []
    for count in range(1, args.rounds + 1):
        plain, study = (seconds_of(way, jobs, args.workers) for way in (back_to_back, as_study))
        ratios.append(plain / study)
        print(
            f"round {count}: back to back {plain:.1f} s, as a study {study:.1f} s, "
            f"share {ratios[-1]:.1%}",
            flush=True,
        )
    print(f"runs back to back over the study's wall-clock time: {statistics.median(ratios):.1%}")


if __name__ == "__main__":
    main()
