"""Train an agent, or continue a run that was stopped."""

from pathlib import Path
from typing import Any

from rich.console import Console

from touchdown.agents.registry import check_fits
from touchdown.api.pipeline import complete
from touchdown.api.runs import RunLike, find_run
from touchdown.config.config import Config
from touchdown.config.fields import with_settings
from touchdown.config.presets import preset
from touchdown.core.progress import console_for
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
    progress: bool | None = None,
    console: Console | None = None,
    **settings: Any,
) -> Run:
    """Train an agent, choose its best checkpoint, test it, and draw its figures and film.

    Args:
        config: the name of a preset, or a config.
        name: name of the run. None takes `<preset>-<seed>`, with a number appended if that name is
            taken.
        runs_dir: folder that holds the runs.
        seed: training seed; None takes the config's.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None takes the notebook's output or standard output.
        settings: settings to change, named as on the command line, such as `learning_rate=1e-3` or
            `hidden_sizes=(64, 64)`; also whole sections, such as `network=NetworkConfig()`.

    Returns:
        The finished run.

    Raises:
        UserError: a setting is unknown or its value is refused, the config, the name, the folder or
            the environment cannot be used, or something could not be written, for example because
            the disk is full; `resume` continues from what was saved.
        Interrupted: Ctrl-C or SIGTERM; the run was saved and `resume` continues it.
    """
    base = preset(config) if isinstance(config, str) else config
    given = settings if seed is None else settings | {"seed": seed}
    chosen = with_settings(base, given)
    # refuse an environment, and settings that do not fit it, before a folder is made
    spaces = environment.spaces_of(chosen.env_id, engine=engines.engine_in_use())
    check_fits(chosen, spaces)
    stop_threshold(chosen)
    folder = folders.create(Path(runs_dir), chosen, name)
    return complete(folder, console_for(progress, console))


def resume(
    run: RunLike,
    *,
    runs_dir: Path | str = DEFAULT_RUNS,
    progress: bool | None = None,
    console: Console | None = None,
) -> Run:
    """Continue a run that was stopped, from its last checkpoint to its end.

    Args:
        run: a run, its name or its folder.
        runs_dir: folder that holds the runs.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None takes the notebook's output or standard output.

    Returns:
        The finished run.

    Raises:
        UserError: there is no such run, its files are broken, or something could not be written.
        Interrupted: stopped again; the run was saved.
    """
    return complete(find_run(run, runs_dir).folder, console_for(progress, console))
