"""Moves a study's results to another machine, to continue the study there."""

from dataclasses import dataclass
from pathlib import Path

from touchdown.api.studies.find import AnyStudy, find_started
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import Run
from touchdown.studies import results, run_lines
from touchdown.studies import store as stores
from touchdown.studies.run_lines import RunLine
from touchdown.studies.run_result import RunResult
from touchdown.studies.store import DEFAULT_RESULTS


@dataclass(frozen=True, slots=True)
class Imported:
    """What an import brought."""

    added: int
    known: int
    """Runs of the file that were there already; they stay as they are."""


def export_results(
    study: AnyStudy,
    path: Path | str,
    *,
    scale: str | None = None,
    force: bool = False,
    results_dir: Path | str = DEFAULT_RESULTS,
) -> int:
    """Write the numbers of a study's finished runs to one file, a line each.

    The file has what verdicts, tables and figures of training runs need; no weights and no flights,
    and no tunings of the PID.

    Args:
        study: a `Study`, the path of a study file, or a name.
        path: the file, `.jsonl`.
        scale: scale of the paper's studies; None uses the scale of the last run.
        force: whether to replace an existing file.
        results_dir: folder that holds the runs.

    Returns:
        The number of runs in the file.

    Raises:
        UserError: there is no such folder or study, none of its runs is done, the file exists
            already, or it cannot be written.
    """
    file = Path(path)
    files.check_file(file, "out")
    files.check_new(file, force=force)
    store = stores.open_store(Path(results_dir))
    selection = find_started(store, study, scale, None)
    if not selection.studies:
        raise UserError(f"study {selection.name!r}: has no training runs to export")
    lines: dict[str, RunLine] = {}
    known: dict[str, RunResult] = {}
    for each, seeds in selection.studies:
        most = max((seeds, *each.looks))
        for run in results.read_study(each, most, store, known).runs:
            lines.setdefault(run.name, results.line_of(run, each))
    if not lines:
        raise UserError(
            f"study {selection.name!r}: none of its runs is done; "
            f"start it with: {selection.command(store)}"
        )
    run_lines.write(file, lines.values())
    return len(lines)


def import_results(path: Path | str, *, results_dir: Path | str = DEFAULT_RESULTS) -> Imported:
    """Add the runs in a file from `export_results` to a results folder, as if they had run there.

    Runs that are there already stay as they are.

    Args:
        path: the file.
        results_dir: folder that holds the runs of studies; made if there is none.

    Raises:
        UserError: there is no such file, it is damaged or something else, the folder is in use, or
            it cannot be written.
    """
    file = Path(path)
    if not file.is_file():
        raise UserError(f"{file}: no such file")
    new = run_lines.read(file)
    for line in new.values():
        try:
            results.check_line(line)
        except UserError as error:
            raise UserError(f"{file}: {error}") from None
    store = stores.open_store(Path(results_dir), make=True)
    with stores.held(store):
        before = store.imported
        added = [
            line
            for line in new.values()
            if line.run not in before and not _is_finished(store.runs / line.run)
        ]
        if added:
            run_lines.write(store.imported_file, [*before.values(), *added])
    return Imported(len(added), len(new) - len(added))


def _is_finished(folder: Path) -> bool:
    return Run(RunFolder(folder)).status == "finished"
