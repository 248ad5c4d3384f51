"""Trains an agent, or resumes a stopped run."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from touchdown.agents.agent import Agent
from touchdown.agents.registry import check_fits
from touchdown.api.pipeline import complete
from touchdown.config.config import Config
from touchdown.config.presets import preset
from touchdown.core import plugins
from touchdown.core.errors import UserError
from touchdown.envs import custom, environment
from touchdown.envs.custom import EnvLike
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
    env: EnvLike | None = None,
    agent: type[Agent] | str | None = None,
    name: str | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
    seed: int | None = None,
    listeners: Iterable[Listener] = (),
    logger: LoggerName | Sequence[LoggerName] | None = None,
    trust: bool = False,
    console: Console | None = None,
) -> Run:
    """Train an agent, select its best checkpoint, test it, and draw its figures and film.

    Args:
        config: settings, or the name of a preset.
        env: a Gymnasium id, `module:Id`, an environment, or a function or class that makes one;
            None uses the config's. An environment is copied for each place in a vector env.
        agent: a class that fulfils `touchdown.agents.agent.Agent`, or its name,
            `package.module:Class`; None uses the config's.
        name: name of the run. None uses `<preset>-<seed>`, with a number appended if that name is
            taken.
        runs_dir: folder of the runs.
        seed: training seed; None uses the config's.
        listeners: objects with `log(step, scalars)` and `close()`, which get every scalar of
            training when it is recorded. Each is closed once, when this function returns or raises.
        logger: `wandb`, `mlflow` or both, to log there too.
        trust: whether to import code that the config names. What `env` and `agent` name is imported
            without it.
        console: where to show progress and results; None shows nothing.

    Returns:
        The finished run.

    Raises:
        UserError: the config, the name, the folder, the environment, the agent, a listener or a
            logger cannot be used, a listener raised an exception, or something could not be
            written, for example because the disk is full; `resume` continues from the last saved
            state.
        Interrupted: Ctrl-C or SIGTERM; the run was saved, and `resume` continues it.
    """
    with Listeners(listeners) as told, plugins.trusting(everything=trust):
        settings = preset(config) if isinstance(config, str) else config
        if seed is not None:
            settings = replace(settings, seed=seed)
        if env is not None:
            settings = replace(settings, env_id=custom.name_of(env))
        if agent is not None:
            settings = replace(settings, algorithm=_name_of(agent))
        # refuse a wrong environment or settings that do not fit it before a folder is created
        spaces = environment.spaces_of(settings.env_id, engine=engines.engine_in_use())
        check_fits(settings, spaces)
        stop_threshold(settings)
        loggers = services.check_names(logger)
        return complete(folders.create(Path(runs_dir), settings, name), console, told, loggers)


def resume(
    run: str,
    *,
    env: EnvLike | None = None,
    agent: type[Agent] | str | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
    listeners: Iterable[Listener] = (),
    logger: LoggerName | Sequence[LoggerName] | None = None,
    trust: bool = False,
    console: Console | None = None,
) -> Run:
    """Resume a stopped run from its last checkpoint and finish it.

    Args:
        run: name or folder of the run.
        env: the environment that the run was started with, if this process cannot find it by name.
        agent: the agent's class, likewise.
        runs_dir: folder of the runs.
        listeners: as for `train`; they get the steps after the last checkpoint again.
        logger: as for `train`; the service's run is continued.
        trust: whether to import code that the run's config names.
        console: where to show progress and results; None shows nothing.

    Returns:
        The finished run.

    Raises:
        UserError: there is no such run, its files are broken, a listener or a logger cannot be used
            or raised an exception, or something could not be written.
        Interrupted: stopped again; the run was saved.
    """
    with Listeners(listeners) as told, plugins.trusting(everything=trust):
        folder = folders.find(run, Path(runs_dir))
        _hand_over(env, agent, folder.config())
        loggers = services.check_names(logger)
        return complete(folder, console, told, loggers)


def _name_of(agent: type[Agent] | str) -> str:
    if isinstance(agent, str):
        plugins.allow(agent)
        return agent
    return plugins.give(agent)


def _hand_over(env: EnvLike | None, agent: type[Agent] | str | None, config: Config) -> None:
    """Let a run's environment and agent be found by the names in its config.

    Raises:
        UserError: a name is not the run's.
    """
    if env is not None and custom.name_of(env, config.env_id) != config.env_id:
        raise UserError(f"env = {env!r}: the run's environment is {config.env_id!r}")
    if isinstance(agent, str):
        plugins.allow(agent)
        if agent != config.algorithm:
            raise UserError(f"agent = {agent!r}: the run's agent is {config.algorithm!r}")
    elif agent is not None:
        plugins.give(agent, config.algorithm)
