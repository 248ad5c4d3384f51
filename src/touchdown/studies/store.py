"""The results folder, shared by all studies: a run that two of them contain is run once."""

import fcntl
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from msgspec import Meta, Struct

from touchdown.core import files, reading, records, temporaries
from touchdown.core.errors import UserError, one_line
from touchdown.studies import run_lines, study_file
from touchdown.studies.job import Job
from touchdown.studies.plan import FIRST_TUNING_SEED, Study
from touchdown.studies.run_lines import RunLine

SomeJob = TypeVar("SomeJob", bound=Job)

FORMAT_VERSION = 1
DEFAULT_RESULTS = Path("runs") / "studies"
_MARK = "studies.json"


class _Mark(Struct, frozen=True):
    """`studies.json`."""

    format_version: Literal[1] = FORMAT_VERSION


class _Failure(Struct, frozen=True):
    """`failed/<digest>.json`."""

    reason: str = ""


@dataclass(frozen=True, slots=True)
class Store:
    """A results folder: `studies.json`, `runs/<digest>/`, `imported.jsonl`, `logs/`, `reports/`."""

    path: Path

    @property
    def runs(self) -> Path:
        """The runs of all studies, each in a folder named by its digest."""
        return self.path / "runs"

    @property
    def failures(self) -> Path:
        """Reasons of failed jobs, one file each."""
        return self.path / "failed"

    @property
    def imported_file(self) -> Path:
        """The results of runs that were made elsewhere."""
        return self.path / "imported.jsonl"

    @property
    def imported(self) -> Mapping[str, RunLine]:
        """What `imported_file` has, by digest.

        Raises:
            UserError: it is damaged.
        """
        return run_lines.read(self.imported_file)

    def missing(self, jobs: Sequence[SomeJob]) -> list[SomeJob]:
        """The jobs that are not done, in order, without duplicates."""
        return [job for job in self._not_imported(jobs) if not job.is_done(self.runs)]

    def without_results(self, jobs: Sequence[SomeJob]) -> list[SomeJob]:
        """The jobs without results, in order, without duplicates."""
        return [job for job in self._not_imported(jobs) if not job.has_results(self.runs)]

    def _not_imported(self, jobs: Sequence[SomeJob]) -> list[SomeJob]:
        imported = self.imported
        asked = {job.digest: job for job in jobs if job.needs_flights or job.digest not in imported}
        return list(asked.values())

    def unrecorded(self, jobs: Sequence[SomeJob]) -> list[SomeJob]:
        """The jobs that have results, but lack some recorded flights."""
        return [job for job in self.missing(jobs) if job.has_results(self.runs)]

    def failed(self) -> dict[str, str]:
        """The reason of each failed job, by digest."""
        if not self.failures.is_dir():
            return {}
        found = sorted(self.failures.glob("*.json"))
        return {path.stem: records.decode_json(path, _Failure).reason for path in found}

    def note_failure(self, digest: str, reason: str) -> None:
        """Record why a job failed."""
        files.make_folder(self.failures)
        files.write_atomic(self.failures / f"{digest}.json", files.to_json(_Failure(reason)))

    def forget_failure(self, digest: str) -> None:
        """Delete the reason of a failure, when the job is retried."""
        (self.failures / f"{digest}.json").unlink(missing_ok=True)


def open_store(path: Path, *, make: bool = False) -> Store:
    """Open a results folder.

    Args:
        path: the folder.
        make: whether to create it if it does not exist.

    Raises:
        UserError: it does not exist, has another version, is something else, or cannot be written.
    """
    mark = path / _MARK
    if mark.is_file():
        try:
            records.decode_json(mark, _Mark, FORMAT_VERSION)
        except UserError as error:
            raise UserError(f"{error}; choose another --results-dir") from None
    elif not make:
        raise UserError(
            f"results_dir {str(path)!r}: has no studies; `touchdown study run` starts one"
        )
    elif not _can_become_store(path):
        raise UserError(
            f"results_dir {str(path)!r}: contains other files; choose an empty or new folder"
        )
    store = Store(path)
    if make:
        with files.refusing(f"results_dir {str(path)!r}"):
            files.make_folder(path)
            # first, so that a folder that was only half made is known as a results folder
            if not mark.is_file():
                files.write_atomic(mark, files.to_json(_Mark()))
            files.make_folder(store.runs)
    return store


def _can_become_store(path: Path) -> bool:
    """Whether a path is free, or a folder that is empty but for what an earlier start left."""
    try:
        if not path.exists():
            return True
        found = [each for each in path.iterdir() if not temporaries.is_temporary(each)]
        # former versions began with this folder
        return all(each.name == "runs" and not any(each.iterdir()) for each in found)
    except OSError as error:
        raise UserError(f"results_dir {str(path)!r}: cannot be read: {one_line(error)}") from None


@contextmanager
def held(store: Store) -> Generator[None]:
    """Hold the lock on a results folder until the block ends or the process dies.

    Raises:
        UserError: another process holds it, or it is not a regular file.
    """
    with files.refusing(str(store.path)), reading.open_appendable(store.path / "lock") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UserError(
                f"results_dir {str(store.path)!r}: another process is running a study there"
            ) from None
        yield


class _BegunFile(Struct, frozen=True):
    """How a study was last started, as recorded in `begun/<name>.json`."""

    scale: str
    seeds: Annotated[int, Meta(ge=0, le=FIRST_TUNING_SEED)]
    file: str | None


@dataclass(frozen=True, slots=True)
class StartedStudy:
    """How a study was last started: the defaults of `status` and `report`."""

    name: str
    scale: str
    seeds: int
    file: str | None
    """The TOML file of a user's study."""


def note_started(store: Store, study: StartedStudy) -> None:
    """Record how a study was started.

    Raises:
        UserError: it cannot be written.
    """
    folder = store.path / "begun"
    content = _BegunFile(study.scale, study.seeds, study.file)
    with files.refusing(str(folder)):
        files.make_folder(folder)
        files.write_atomic(folder / f"{study.name}.json", files.to_json(content))


def kept_file(store: Store, study: Study) -> Path:
    """The study file of a study made in Python."""
    return store.path / "begun" / f"{study.name}.toml"


def keep(store: Store, study: Study) -> Path:
    """Save a study made in Python as a study file, so that the command line finds it.

    Returns:
        The file.

    Raises:
        UserError: it cannot be written.
    """
    path = kept_file(store, study)
    with files.refusing(str(path)):
        files.make_folder(path.parent)
        files.write_atomic(path, study_file.to_toml(study))
    return path


def list_started(store: Store) -> list[str]:
    """The name of every study that was started in a results folder."""
    return sorted(path.stem for path in (store.path / "begun").glob("*.json"))


def read_started(store: Store, name: str) -> StartedStudy | None:
    """How a study was last started; None if it was not started in this results folder.

    Raises:
        UserError: the record is broken.
    """
    path = store.path / "begun" / f"{name}.json"
    if not path.is_file():
        return None
    found = records.decode_json(path, _BegunFile)
    kept = path.with_suffix(".toml")
    file = str(kept) if found.file is None and kept.is_file() else found.file
    return StartedStudy(name, found.scale, found.seeds, file)
