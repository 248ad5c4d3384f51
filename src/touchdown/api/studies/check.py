"""Simulates the error rates of the statistics behind a study's verdicts."""

import dataclasses
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.core.progress import Counter, console_for, stop_on_signals

if TYPE_CHECKING:
    from touchdown.stats.simulation import CheckRow

_REPETITIONS = 20_000


def check_statistics(
    *,
    repetitions: int = _REPETITIONS,
    seed: int = 0,
    out: Path | str | None = None,
    force: bool = False,
    progress: bool | None = None,
    console: Console | None = None,
) -> "list[CheckRow]":
    """Simulate the error rate, the coverage and the power of every test, interval and verdict.

    Args:
        repetitions: simulated data sets of each row; slow procedures get a fixed share of them.
        seed: seed of the simulation.
        out: Markdown file for the tables, `.md`; the rows are written beside it as `.csv`. None
            writes neither.
        force: whether to replace existing files.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Raises:
        UserError: a number is out of range, or a file exists already or cannot be written.
        Interrupted: Ctrl-C, SIGTERM or SIGHUP; nothing is written.
    """
    if repetitions < 1:
        raise UserError(f"repetitions = {repetitions}: must be at least 1")
    if seed < 0:
        raise UserError(f"seed = {seed}: must be at least 0")
    page = None if out is None else Path(out)
    if page is not None:
        if page.suffix != ".md":
            raise UserError(f"out = {str(page)!r}: must end with .md")
        for path in (page, page.with_suffix(".csv")):
            files.check_file(path, "out")
            files.check_new(path, force=force)
    from touchdown.stats import simulation  # noqa: PLC0415 - it loads SciPy's statistics

    shown = console_for(progress, console)
    with (
        Counter(shown, "simulating", simulation.count_rows()) as count,
        stop_on_signals(shown) as stop,
    ):

        def on_row() -> None:
            count()
            stop.check()

        rows = simulation.simulate(repetitions, seed, on_row=on_row)
    if page is not None:
        _write(rows, page, repetitions, seed)
    return rows


def _write(rows: "list[CheckRow]", page: Path, repetitions: int, seed: int) -> None:
    import polars as pl  # noqa: PLC0415 - heavy libraries load when used

    from touchdown.stats import simulation  # noqa: PLC0415 - it loads SciPy's statistics

    words = ["touchdown", "study", "check", "--repetitions", str(repetitions), "--seed", str(seed)]
    command = shlex.join([*words, "--out", page.name])
    table = pl.DataFrame([dataclasses.asdict(row) for row in rows]).with_columns(
        pl.col("error", "strict_error", "coverage", "power").fill_nan(None)
    )
    text = f"{_INTRODUCTION.format(command=command)}\n\n{simulation.to_markdown(rows)}\n"
    with files.refusing(f"out {str(page)!r}"):
        files.write_atomic(page.with_suffix(".csv"), table.write_csv(float_precision=4))
        files.write_atomic(page, text)


_INTRODUCTION = """# Error rates of the statistics

Made by `{command}`.

Each rate is from simulated studies whose truth is known. Rows are scenarios: the two settings
that are compared have different distributions of returns, which resemble those of training runs.
Most runs land near 240; in "10% fail", a tenth of the runs of one setting fail, at about
-100 ± 200, and the other setting is steady. Columns are training seeds of each setting.

- For a test or a verdict, the first number is the percentage of wrong decisions where nothing
  differs, or where the difference is exactly the margin. It claims 5%; its limit is 6%. After the
  slash is the power: the percentage of right decisions where there is an effect, which for a test
  is 20 return points.
- For an interval, the number is the percentage of intervals that contain the truth. It claims 95%;
  its limit is 93%.

A number outside its limit by more than two standard errors of the simulation is bold. *Keeps its
limit from* is the smallest number of seeds from which on no number is bold. The verdicts of studies
use only procedures that keep their limit, and give no verdict with fewer seeds."""
