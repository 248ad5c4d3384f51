"""Shows runs on a local page while they learn, or writes the page as one file."""

import contextlib
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from touchdown.api.runs import RunLike, find_run
from touchdown.api.studies.find import find_each_started, find_started
from touchdown.core import files
from touchdown.core.browser import open_page
from touchdown.core.errors import UserError
from touchdown.core.progress import console_for
from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS, RunFolder
from touchdown.studies import store as stores
from touchdown.studies.store import Store
from touchdown.web.watch.run_index import RunIndex, StudyRuns, key_of

_SUFFIX = ".html"


def watch(
    runs: RunLike | Sequence[RunLike] = (),
    *,
    runs_dir: Path | str = DEFAULT_RUNS,
    port: int = 0,
    out: Path | str | None = None,
    force: bool = False,
    browser: bool = True,
    console: Console | None = None,
) -> Path | None:
    """Show runs on a local page, those under way as they learn, or write the page as one file.

    The page is served on 127.0.0.1 until Ctrl-C, at an address that contains a secret. Watching
    reads the runs' records and changes nothing.

    Args:
        runs: a run, its name or its folder, the name of a study that was started in `runs_dir`, or
            several of them. Without one, the page is a list of all runs.
        runs_dir: folder that holds the runs.
        port: number of the port; 0 takes a free one.
        out: an `.html` file to write instead. It needs no server and no network.
        force: whether to replace an existing file.
        browser: whether to open the page in a browser, if this machine has a display.
        console: where to show the address; None uses standard output.

    Returns:
        The written file; None if the page was served.

    Raises:
        UserError: there is no such run, the port is taken, or `out` exists already or cannot be
            written.
    """
    folder = Path(runs_dir)
    several = [runs] if isinstance(runs, RunLike) else list(runs)
    named = [each for run in several for each in _folders(run, folder)]
    found = list({key_of(each): each for each in named}.values())
    if out is not None:
        return _write(found, Path(out), folder, force=force)
    if not found and not folder.is_dir():
        raise UserError(f"runs_dir {str(folder)!r}: no such folder; `touchdown train` creates it")
    from touchdown.web.watch.serving import Server  # noqa: PLC0415 - only to serve

    server = Server(index_of(folder, found), port)
    address = server.address_of([key_of(each) for each in found])
    shown = console_for(progress=True, console=console)
    shown.print(f"watch: {address}", soft_wrap=True, markup=False, highlight=False)
    shown.print("Ctrl-C ends the server", markup=False, highlight=False)
    with contextlib.suppress(KeyboardInterrupt), open_page(address if browser else None):
        server.serve()
    return None


def index_of(runs_dir: Path, named: Sequence[RunFolder] = ()) -> RunIndex:
    """The runs that a server may show: those in a folder, of the studies in it, and named ones."""
    return RunIndex(runs_dir, named, lambda: _studies(runs_dir))


def _folders(run: RunLike, runs_dir: Path) -> list[RunFolder]:
    """The folder of a run, or those of a study."""
    try:
        return [find_run(run, runs_dir).folder]
    except UserError as error:
        if not isinstance(run, str):
            raise
        found = _runs_of_study(run, runs_dir)
        if found is None:
            raise
        if not found:
            raise UserError(f"study {run!r}: has no runs yet") from error
        return found


def _runs_of_study(name: str, runs_dir: Path) -> list[RunFolder] | None:
    """The runs of a study so far; None if no study of that name was started."""
    store = _store(runs_dir)
    if store is None or name not in stores.list_started(store):
        return None
    jobs = find_started(store, name, None, None).train_jobs
    paths = [store.runs / job.digest for job in jobs]
    return [folders.RunFolder(path) for path in paths if (path / "config.toml").is_file()]


def _store(runs_dir: Path) -> Store | None:
    """The results folder of studies in a folder of runs; None if there is none."""
    try:
        return stores.open_store(runs_dir / stores.DEFAULT_RESULTS.name)
    except UserError:
        return None


def _studies(runs_dir: Path) -> StudyRuns | None:
    """The runs of the studies in a folder of runs; a study that cannot be read is left out."""
    store = _store(runs_dir)
    if store is None:
        return None
    labels: dict[str, dict[str, str]] = {}
    with contextlib.suppress(UserError):  # none was started
        for name, selection in find_each_started(store, None, None).items():
            if not isinstance(selection, UserError):
                names = selection.job_names()
                labels[name] = {
                    job.digest: names[job.digest].removeprefix(f"{name} ")
                    for job in selection.train_jobs
                }
    return StudyRuns(store.runs, labels)


def _write(found: Sequence[RunFolder], out: Path, runs_dir: Path, *, force: bool) -> Path:
    """Write the page of some runs as one file."""
    if out.suffix.lower() != _SUFFIX:
        raise UserError(f"out {str(out)!r}: must end in {_SUFFIX}")
    files.check_file(out, "out")
    files.check_new(out, force=force)
    if not found:
        raise UserError("out: needs a run: touchdown watch RUN --out FILE")
    from touchdown.web.watch.one_file import write_page  # noqa: PLC0415 - only to write

    write_page(index_of(runs_dir, found), [key_of(each) for each in found], out)
    return out
