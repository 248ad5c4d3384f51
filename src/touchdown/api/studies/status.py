"""Progress of each study, and its failed runs."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from touchdown.api.studies.find import (
    AnyStudy,
    StudySelection,
    find_each_started,
    find_started,
)
from touchdown.core.errors import UserError
from touchdown.studies import store as stores
from touchdown.studies.store import DEFAULT_RESULTS, Store


@dataclass(frozen=True, slots=True)
class StudyProgress:
    """Progress of one study."""

    name: str
    runs: int
    done: int
    """Trained and tested."""
    failed: dict[str, str]
    """The reason of each failure, by the name of the run."""
    unfinished: int = 0
    """Started and saved, but neither done nor failed."""
    unrecorded: int = 0
    """Done runs without recorded flights, because an earlier version ran them; `study run` records
    the flights without training again."""
    command: str = ""
    """What runs the rest; "" if all is done."""
    error: str | None = None
    """Why its runs are not known, for example because its file was moved."""

    def to_dict(self) -> dict[str, Any]:
        """As values for JSON."""
        return dataclasses.asdict(self)


def study_status(
    study: AnyStudy | None = None,
    *,
    scale: str | None = None,
    seeds: int | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
) -> list[StudyProgress]:
    """Progress of each study.

    Args:
        study: a `Study`, the path of a study file, or a name; None selects all that were started
            in the folder.
        scale: scale of the paper's studies; None uses the scale of the last run.
        seeds: training seeds of each level; None uses the number of the last run.
        results_dir: folder that holds the runs and reports of studies.

    Raises:
        UserError: there is no such folder or study. If all are shown, one whose file cannot be
            read has an `error` instead.
    """
    store = stores.open_store(Path(results_dir))
    failures = store.failed()
    if study is not None:
        return _progress_of(find_started(store, study, scale, seeds), store, failures)
    found: list[StudyProgress] = []
    for name, selection in find_each_started(store, scale, seeds).items():
        if isinstance(selection, UserError):
            found.append(StudyProgress(name, 0, 0, {}, error=str(selection)))
        else:
            found += _progress_of(selection, store, failures)
    return found


def _progress_of(
    selection: StudySelection, store: Store, failures: Mapping[str, str]
) -> list[StudyProgress]:
    found: list[StudyProgress] = []
    names = selection.job_names()
    groups = selection.groups
    if selection.in_looks:
        groups = selection.groups_until_decided(store)
    for label, jobs in groups:
        missing = {job.digest for job in store.without_results(jobs)}
        started = {digest for digest in missing if (store.runs / digest).is_dir()}
        found.append(
            StudyProgress(
                name=label,
                runs=len(jobs),
                done=len(jobs) - len(missing),
                failed={names[d]: failures[d] for d in sorted(missing) if d in failures},
                unfinished=len(started - failures.keys()),
                unrecorded=len(store.unrecorded(jobs)),
                command=selection.command(store) if missing else "",
            )
        )
    return found
