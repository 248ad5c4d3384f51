"""Train an agent, or continue a run that was stopped."""

from collections.abc import Iterable, Sequence
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
from touchdown.training import services
from touchdown.training.listeners import Listener, Listeners
from touchdown.training.selection import stop_threshold
from touchdown.training.services import LoggerName


def train(
    config: Config | str = "pilot",
    *,
    name: str | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
    seed: int | None = None,
    listeners: Iterable[Listener] = (),
    logger: LoggerName | Sequence[LoggerName] | None = None,
    console: Console | None = None,
) -> Run:
    """Train an agent, choose its best checkpoint, test it, and draw its figures and film.

    Args:
        config: settings, or the name of a preset.
        name: name of the run. None takes `<preset>-<seed>`, with a number appended if that name is
            taken.
        runs_dir: folder that holds the runs.
        seed: training seed; None takes the config's.
        listeners: objects with `log(step, scalars)` and `close()`, told every scalar of training as
            it is recorded. Each is closed once, when this function returns or raises.
        logger: `wandb`, `mlflow` or several, which log there too.
        console: where to show progress and results; None shows nothing.

    Returns:
        The finished run.

    Raises:
        UserError: the config, the name, the folder, the environment, a listener or a logger cannot
            be used, a listener raised an exception, or something could not be written, for example
            because the disk is full; `resume` continues from what was saved.
        Interrupted: Ctrl-C or SIGTERM; the run was saved and `resume` continues it.
    """
    with Listeners(listeners) as told:
        settings = preset(config) if isinstance(config, str) else config
        if seed is not None:
            settings = replace(settings, seed=seed)
        # refuse what cannot be used, and settings that do not fit, before a folder is made
        spaces = environment.spaces_of(settings.env_id, engine=engines.engine_in_use())
        check_fits(settings, spaces)
        stop_threshold(settings)
        loggers = services.check_names(logger)
        return complete(folders.create(Path(runs_dir), settings, name), console, told, loggers)


def resume(
    run: str,
    *,
    runs_dir: Path | str = DEFAULT_RUNS,
    listeners: Iterable[Listener] = (),
    logger: LoggerName | Sequence[LoggerName] | None = None,
    console: Console | None = None,
) -> Run:
    """Continue a run that was stopped, from its last checkpoint to its end.

    Args:
        run: name of the run, or its folder.
        runs_dir: folder that holds the runs.
        listeners: as for `train`; they are told again of the steps after the last checkpoint.
        logger: as for `train`; the run continues the one that it has there.
        console: where to show progress and results; None shows nothing.

    Returns:
        The finished run.

    Raises:
        UserError: there is no such run, its files are broken, a listener or a logger cannot be used
            or raised an exception, or something could not be written.
        Interrupted: stopped again; the run was saved.
    """
    with Listeners(listeners) as told:
        loggers = services.check_names(logger)
        return complete(folders.find(run, Path(runs_dir)), console, told, loggers)
