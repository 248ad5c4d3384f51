"""Trains an agent, or resumes a stopped run."""

from dataclasses import replace
from pathlib import Path

from rich.console import Console

from touchdown.agents.registry import check_fits
from touchdown.api.pipeline import complete
from touchdown.config.config import Config
from touchdown.config.presets import preset
from touchdown.envs import environment
from touchdown.lander import engine as engines
from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run
from touchdown.training.selection import stop_threshold


def train(
    config: Config | str = "pilot",
    *,
    name: str | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
    seed: int | None = None,
    console: Console | None = None,
) -> Run:
    """Train an agent, select its best checkpoint, test it, and draw its figures and film.

    Args:
        config: settings, or the name of a preset.
        name: name of the run. None uses `<preset>-<seed>`, with a number appended if that name is
            taken.
        runs_dir: folder of the runs.
        seed: training seed; None uses the config's.
        console: where to show progress and results; None shows nothing.

    Returns:
        The finished run.

    Raises:
        UserError: the config, the name, the folder or the environment cannot be used, or something
            could not be written, for example because the disk is full; `resume` continues from the
            last saved state.
        Interrupted: Ctrl-C or SIGTERM; the run was saved, and `resume` continues it.
    """
    settings = preset(config) if isinstance(config, str) else config
    if seed is not None:
        settings = replace(settings, seed=seed)
    # refuse a wrong environment or settings that do not fit it before a folder is created
    spaces = environment.spaces_of(settings.env_id, engine=engines.engine_in_use())
    check_fits(settings, spaces)
    stop_threshold(settings)
    return complete(folders.create(Path(runs_dir), settings, name), console)


def resume(run: str, *, runs_dir: Path | str = DEFAULT_RUNS, console: Console | None = None) -> Run:
    """Resume a stopped run from its last checkpoint and finish it.

    Args:
        run: name or folder of the run.
        runs_dir: folder of the runs.
        console: where to show progress and results; None shows nothing.

    Returns:
        The finished run.

    Raises:
        UserError: there is no such run, its files are broken, or something could not be written.
        Interrupted: stopped again; the run was saved.
    """
    return complete(folders.find(run, Path(runs_dir)), console)
