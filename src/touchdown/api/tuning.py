"""Tunes the PID controller."""

from pathlib import Path

from rich.console import Console

from touchdown.control.pid import PIDConfig, Rule
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.core.progress import Counter, console_for, stop_on_signals
from touchdown.core.seeding import check_seed
from touchdown.policies import baselines
from touchdown.training import pid_tuning


def tune_pid(
    *,
    rule: Rule = "signed",
    starts: int = 200,
    seed: int = 0,
    tolerance: float = 0.2,
    begin: PIDConfig | Path | str | None = None,
    out: Path | str | None = None,
    force: bool = False,
    progress: bool | None = None,
    console: Console | None = None,
) -> PIDConfig:
    """Tune the PID controller's gains and dead band with Twiddle, on training starts.

    Args:
        rule: the action rule to tune for: `signed` or `absolute`.
        starts: number of training starts per trial.
        seed: chooses the starts.
        tolerance: stop once every step is below this fraction of its initial size; above 0 and
            below 1.
        begin: gains to start from, or a TOML file of them, such as the result of an earlier tuning;
            None starts from hand-picked gains.
        out: a TOML file for the gains; None only returns them.
        force: whether to replace an existing file.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Returns:
        The best gains found, even if tuning was stopped early.

    Raises:
        UserError: a number is out of range, `begin` is broken, or `out` exists already or cannot be
            written.
    """
    if starts < 1:
        raise UserError(f"starts = {starts}: must be at least 1")
    if not 0 < tolerance < 1:
        raise UserError(f"tolerance = {tolerance}: must be between 0 and 1")
    check_seed(seed)
    if out is not None:
        files.check_file(Path(out), "out")
        files.check_new(Path(out), force=force)
    if begin is None:
        first = pid_tuning.HAND_PICKED
    else:
        first = begin if isinstance(begin, PIDConfig) else baselines.read_pid(Path(begin))
    shown = console_for(progress, console)
    step = None
    with (
        stop_on_signals(shown) as stop,
        Counter(shown, "tuning the PID", 1.0) as count,
    ):
        for step in pid_tuning.tune_pid(rule, starts, seed, tolerance, first):
            done = pid_tuning.share_done(step.step, tolerance)
            count.describe(f"trial {step.trial}, best mean return {step.best_return:.1f}", done)
            if stop():
                break
    if step is None:
        raise UserError("tuning was stopped before its first trial ended")
    if out is not None:
        with files.refusing(f"{step.best}: found, but out {str(out)!r}"):
            files.write_atomic(Path(out), pid_tuning.to_toml(step, starts, seed, first))
    return step.best
