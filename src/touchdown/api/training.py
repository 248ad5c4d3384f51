"""Trains an agent, or resumes a stopped run."""

import warnings
from collections.abc import Generator, Iterable, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import Any

from rich.console import Console

from touchdown.agents.agent import Agent
from touchdown.agents.registry import check_fits
from touchdown.api.pipeline import complete
from touchdown.api.runs import RunLike, find_run
from touchdown.config.config import Config
from touchdown.config.fields import with_settings
from touchdown.config.presets import preset
from touchdown.core import plugins
from touchdown.core.errors import UserError
from touchdown.core.progress import console_for
from touchdown.envs import custom, environment
from touchdown.envs.custom import EnvLike
from touchdown.lander import engine as engines
from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS, RunFolder
from touchdown.runs.run import Run
from touchdown.training import services
from touchdown.training.listeners import Listener, Listeners
from touchdown.training.selection import stop_threshold
from touchdown.training.services import LoggerName
from touchdown.web.watch import training_server


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
    watch: bool = False,
    browser: bool = True,
    trust: bool = False,
    progress: bool | None = None,
    console: Console | None = None,
    **settings: Any,
) -> Run:
    """Train an agent, select its best checkpoint, test it, and draw its figures and film.

    Args:
        config: the name of a preset, or a config.
        env: a Gymnasium id, `module:Id`, an environment, or a function or class that makes one;
            None uses the config's. An environment is copied for each one in a vector env.
        agent: a class that fulfils `touchdown.agents.agent.Agent`, or its name,
            `package.module:Class`; None uses the config's.
        name: name of the run. None uses `<preset>-<seed>`, with a number appended if that name is
            taken.
        runs_dir: folder of the runs.
        seed: training seed; None uses the config's.
        listeners: objects with `log(step, scalars)` and `close()`, which receive every scalar of
            training when it is recorded. Each is closed once, when this function returns or
            raises.
        logger: `wandb`, `mlflow` or both, to log there too.
        watch: whether to show the training on a local page. The page stays when training ends, as
            long as it is open. Its address is printed even if `progress` is False.
        browser: whether to open that page in a browser, if this machine has a display.
        trust: whether to import code that the config names. Code that the other arguments name is
            imported without it.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.
        settings: settings to change, named as on the command line, such as `learning_rate=1e-3`,
            `hidden_sizes=(64, 64)` or an agent's `options={"tau": 0.1}`; also whole sections, such
            as `network=NetworkConfig()`.

    Returns:
        The finished run.

    Raises:
        UserError: a setting is unknown or its value is refused; the name, the folder, the
            environment, the agent, a listener or a logger cannot be used; a listener raised an
            exception; or something could not be written, for example because the disk is full:
            `resume` continues from the last saved state.
        Interrupted: Ctrl-C, SIGTERM or SIGHUP; the run was saved, and `resume` continues it.
    """
    with Listeners(listeners) as told, plugins.trusting(everything=trust):
        base = preset(config) if isinstance(config, str) else config
        given = dict(settings)
        if seed is not None:
            given["seed"] = seed
        if env is not None:
            given["env_id"] = env
        if agent is not None:
            given["algorithm"] = agent
        chosen = with_settings(base, _named(given))
        # refuse a wrong environment or settings that do not fit it before a folder is created
        spaces = environment.spaces_of(chosen.env_id, engine=engines.engine_in_use())
        check_fits(chosen, spaces)
        stop_threshold(chosen)
        loggers = services.check_names(logger)
        folder = folders.create(Path(runs_dir), chosen, name)
        shown = console_for(progress, console)
        with _watched(folder, console, browser=browser) if watch else nullcontext():
            return complete(folder, shown, told, loggers)


def resume(
    run: RunLike,
    *,
    env: EnvLike | None = None,
    agent: type[Agent] | str | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
    listeners: Iterable[Listener] = (),
    logger: LoggerName | Sequence[LoggerName] | None = None,
    watch: bool = False,
    browser: bool = True,
    trust: bool = False,
    progress: bool | None = None,
    console: Console | None = None,
) -> Run:
    """Resume a stopped run from its last checkpoint and finish it.

    Args:
        run: a run, its name or its folder.
        env: the environment that the run was started with, if this process cannot find it by name.
        agent: the agent's class, likewise.
        runs_dir: folder of the runs.
        listeners: as for `train`; they receive the steps after the last checkpoint again.
        logger: as for `train`; the service's run is continued.
        watch: as for `train`; a finished run is not served.
        browser: as for `train`.
        trust: whether to import code that the run's config names.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Returns:
        The finished run.

    Raises:
        UserError: there is no such run, its files are broken, a listener or a logger cannot be used
            or raised an exception, or something could not be written.
        Interrupted: stopped again; the run was saved.
    """
    with Listeners(listeners) as told, plugins.trusting(everything=trust):
        folder = find_run(run, runs_dir).folder
        _hand_over(env, agent, folder.config())
        is_watched = watch and Run(folder).status != "finished"  # otherwise there is no training
        if is_watched:
            folders.lock(folder).close()  # refuse before a page opens
        loggers = services.check_names(logger)
        shown = console_for(progress, console)
        with _watched(folder, console, browser=browser) if is_watched else nullcontext():
            return complete(folder, shown, told, loggers)


@contextmanager
def _watched(folder: RunFolder, console: Console | None, *, browser: bool) -> Generator[None]:
    """Serve the page of a run while the block trains it; without a server it trains all the same.

    Its address is printed even where progress is not shown, because nobody can guess it.
    """
    with ExitStack() as stack:
        try:
            address = stack.enter_context(training_server.watched(folder, browser=browser))
        except UserError as error:
            warnings.warn(f"{error}; training goes on without the page", stacklevel=2)
        else:
            shown = console_for(progress=True, console=console)
            shown.print(f"watch: {address}", soft_wrap=True, markup=False, highlight=False)
        yield


def _named(settings: dict[str, Any]) -> dict[str, Any]:
    """The settings, with the names of the environment and the agent that the user passed."""
    named = dict(settings)
    if "env_id" in named:
        named["env_id"] = custom.name_of(named["env_id"])
    agent = named.get("algorithm")
    if isinstance(agent, str):
        plugins.write(agent)
    elif agent is not None:
        named["algorithm"] = plugins.give(agent)
    return named


def _hand_over(env: EnvLike | None, agent: type[Agent] | str | None, config: Config) -> None:
    """Register a run's environment and agent under the names in its config.

    Raises:
        UserError: the run has another environment or agent, or one that has to be passed again.
    """
    for field, given, name in (("env", env, config.env_id), ("agent", agent, config.algorithm)):
        what = "environment" if field == "env" else "agent"
        if given is None and plugins.is_local(name):
            raise UserError(
                f"{field} = None: the run's {what} is {name!r}, a local function or an object; "
                f"pass it again: {field}=..."
            )
        if isinstance(given, str):
            plugins.write(given)
            same = given == name
        else:
            same = given is None or plugins.is_plugin(name)
        if not same:
            raise UserError(f"{field} = {given!r}: the run's {what} is {name!r}")
    if env is not None and not isinstance(env, str):
        custom.name_of(env, config.env_id)
    if agent is not None and not isinstance(agent, str):
        plugins.give(agent, config.algorithm)
