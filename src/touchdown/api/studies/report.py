"""Writes the page of a study from the records of its runs."""

import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from touchdown.api.studies.find import (
    PAPER,
    READINGS,
    AnyStudy,
    StudySelection,
    find_each_started,
    find_started,
)
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.core.progress import Counter, console_for
from touchdown.studies import paper
from touchdown.studies import store as stores
from touchdown.studies.paper.readings import readings
from touchdown.studies.store import DEFAULT_RESULTS, Store

if TYPE_CHECKING:
    from touchdown.report.output import Report


def study_report(
    study: AnyStudy | None = None,
    *,
    scale: str | None = None,
    seeds: int | None = None,
    out: Path | str | None = None,
    force: bool = False,
    results_dir: Path | str = DEFAULT_RESULTS,
    progress: bool | None = None,
    console: Console | None = None,
) -> "Report":
    """Write a study's page: figures, verdicts on its claims, flights, tables.

    The folder also gets `summary.md` and, in `tables/`, the runs, levels and claims as CSV files.

    Args:
        study: a `Study`, the path of a study file, or a name; None uses the only one that
            was started.
        scale: scale of the paper's studies; None uses the scale of the last run.
        seeds: training seeds of each level; None uses the number of the last run.
        out: folder for the page; None creates one in the results folder, with links to the runs.
        force: whether to replace the page in an existing folder.
        results_dir: folder that holds the runs and reports of studies.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Raises:
        UserError: there is no such folder or study, none of its runs is done, the folder exists
            already, or the page cannot be written.
    """
    store = stores.open_store(Path(results_dir))
    if study is None:
        selection = _only_started(store, scale, seeds)
    else:
        selection = find_started(store, study, scale, seeds)
    if selection.has_looks:
        if seeds is not None:
            raise UserError(f"seeds = {seeds}: must be left out; the looks say how many")
        selection = replace(selection, seeds=None)
    runs = [*selection.pid_jobs, *selection.train_jobs]
    if len(store.without_results(runs)) == len(runs):
        raise UserError(
            f"study {selection.name!r}: none of its runs is done; "
            f"start it with: {selection.command(store)}"
        )
    folder = Path(out) if out is not None else store.path / "reports" / selection.name
    files.check_new(folder, force=force)
    from touchdown.report.builder import STEPS  # noqa: PLC0415 - it loads matplotlib
    from touchdown.report.paper_page import write_paper_report  # noqa: PLC0415 - it loads matplotlib
    from touchdown.report.readings_page import (  # noqa: PLC0415 - it loads matplotlib
        write_readings_report,
    )
    from touchdown.report.study_page import write_study_report  # noqa: PLC0415 - it loads matplotlib

    command = f"{selection.command(store)} && {_report_command(selection, store, out)}"
    note = _note_on_flights(selection, store)
    shown = console_for(progress, console)
    sections = len(paper.topics(selection.scale)) if selection.name == PAPER else 1
    steps = len(readings()) if selection.name == READINGS else STEPS * sections
    with Counter(shown, f"writing the report of {selection.name}", steps) as count:

        def on_step(_name: str) -> None:
            count()

        if not selection.is_paper:
            ((own, n),) = selection.studies
            return write_study_report(
                own,
                n,
                store,
                folder,
                command=command,
                note=note,
                linked=out is None,
                on_step=on_step,
            )
        if selection.name == READINGS:
            return write_readings_report(
                selection.scale,
                selection.seeds,
                store,
                folder,
                command=command,
                note=note,
                on_step=on_step,
            )
        return write_paper_report(
            selection.scale,
            selection.seeds,
            store,
            folder,
            names=None if selection.name == PAPER else [selection.name],
            command=command,
            note=note,
            linked=out is None,
            on_step=on_step,
        )


def _only_started(store: Store, scale: str | None, seeds: int | None) -> StudySelection:
    started = find_each_started(store, scale, seeds)
    if len(started) > 1:
        names = ", ".join(started)
        raise UserError(f"study: must be one of {names}, because several studies were started")
    (found,) = started.values()
    if isinstance(found, UserError):
        raise found
    return found


def _report_command(selection: StudySelection, store: Store, out: Path | str | None) -> str:
    to = [] if out is None else ["--out", str(out)]
    where = [] if store.path == DEFAULT_RESULTS else ["--results-dir", str(store.path)]
    return shlex.join(["touchdown", "study", "report", selection.name, *to, *where])


def _note_on_flights(selection: StudySelection, store: Store) -> str:
    """A sentence about missing flights; "" if there are none."""
    runs = len(store.unrecorded(selection.jobs))
    if not runs and not store.without_results(selection.baselines):
        return ""
    what = [f"the flights of {runs} finished run{'s' * (runs > 1)}"] if runs else []
    what += ["the baselines' flights"] if store.without_results(selection.baselines) else []
    text = f"{' and '.join(what)} are not recorded, so this page omits what needs them. "
    return f"{text[0].upper()}{text[1:]}{selection.command(store)} records them without training."
