"""Runs the missing jobs of studies and reports their state."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from touchdown.studies.executors import Event, Executor
from touchdown.studies.job import NOT_STARTED, Job, JobProgress
from touchdown.studies.plan import Study
from touchdown.studies.store import Store
from touchdown.studies.work import TrainJob


@dataclass(slots=True)
class State:
    """Progress of a study."""

    total: int
    done: int
    """Number of done jobs, including earlier ones."""
    running: dict[str, JobProgress] = field(default_factory=dict[str, JobProgress])
    failed: dict[str, str] = field(default_factory=dict[str, str])
    died: int = 0

    @property
    def share(self) -> float:
        """The share of all jobs that is done; running ones count partially."""
        if not self.total:
            return 1.0
        under_way = sum(progress.share for progress in self.running.values())
        return (self.done + len(self.failed) + under_way) / self.total


def jobs_of(studies: Sequence[tuple[Study, int]]) -> list[TrainJob]:
    """The training runs of studies with their numbers of seeds, by seed, without duplicates."""
    planned = [run for study, seeds in studies for run in study.runs(seeds)]
    planned.sort(key=lambda run: run.seed)  # a stable sort: studies keep their order
    return list({run.digest: TrainJob(run.config) for run in planned}.values())


def run_jobs(
    jobs: Sequence[Job],
    store: Store,
    executor: Executor,
    *,
    on_state: Callable[[State, Event], object] = lambda _state, _event: None,
    should_stop: Callable[[], bool] = lambda: False,
) -> State:
    """Run the missing jobs; the caller holds the store (`stores.held`).

    Args:
        jobs: all jobs, done or not.
        store: the store for their results.
        executor: runs them.
        on_state: called after each event.
        should_stop: called regularly; True saves unfinished jobs and stops.

    Returns:
        The state at the end; it names the jobs that failed.

    Raises:
        Interrupted: `should_stop` returned True.
        UserError: nothing can be written.
    """
    missing = store.missing(jobs)
    total = len({job.digest for job in jobs})
    state = State(total, total - len(missing))

    def hear(event: Event) -> None:
        if event.kind == "started":
            store.forget_failure(event.digest)
            state.running[event.digest] = NOT_STARTED
        elif event.kind == "advanced":
            state.running[event.digest] = event.progress
        else:
            state.running.pop(event.digest, None)
            state.done += event.kind == "done"
            state.died += event.kind == "died"
            if event.kind == "failed":
                state.failed[event.digest] = event.text
                store.note_failure(event.digest, event.text)
        on_state(state, event)

    if missing:
        executor.run(missing, store.runs, hear, should_stop)
    return state
