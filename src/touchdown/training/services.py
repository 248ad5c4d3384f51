"""Logging services by name, W&B and MLflow, as listeners; a resumed run continues its run there.

Each service is an extra, imported when it is used.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal, Protocol, cast, get_args

import msgspec
from msgspec import Struct

from touchdown.config.config import Config
from touchdown.core import files, installation, records
from touchdown.core.errors import UserError, one_line
from touchdown.core.names import hint
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.training.listeners import Listener, ListenerError, Listeners

LoggerName = Literal["wandb", "mlflow"]
FORMAT_VERSION = 1


class ServiceLogger(Listener, Protocol):
    """A listener that logs to a run of a logging service."""

    @property
    def run_id(self) -> str:
        """The id of the run at the service."""
        ...

    @property
    def where(self) -> str:
        """Location of the run for the user: a URL, or a local path."""
        ...


class LoggerRuns(Struct, frozen=True, kw_only=True):
    """`loggers.json`: the run's id at each logging service, for resuming."""

    format_version: Literal[1] = FORMAT_VERSION
    run_ids: dict[str, str] = msgspec.field(default_factory=dict[str, str])
    """Ids by the name of the service."""


def check_names(logger: LoggerName | Sequence[LoggerName] | None) -> tuple[LoggerName, ...]:
    """The requested logging services, without duplicates.

    Args:
        logger: the name of a service, a sequence of names, or None.

    Raises:
        UserError: there is no such service, or it is not installed.
    """
    if logger is None:
        return ()
    several = tuple(logger) if isinstance(logger, (list, tuple)) else (logger,)
    named = cast(tuple[LoggerName, ...], several)  # each is checked to be one of them
    for name in named:
        if name not in get_args(LoggerName):
            raise UserError(f"logger {name!r}: {hint(name, get_args(LoggerName))}")
        _class_of(name)
    return tuple(dict.fromkeys(named))


def open_loggers(
    names: Sequence[LoggerName], folder: RunFolder, listeners: Listeners
) -> dict[str, str]:
    """Open a run at each logging service: a new one, or the existing one of this run.

    Args:
        names: names of the services.
        folder: folder of the run; its `loggers.json` stores the run's id at each service.
        listeners: the listeners to which the services are added.

    Returns:
        The location of the run, by the name of the service.

    Raises:
        ListenerError: a service refuses; its own exception is the cause.
        UserError: a service is not installed, another process is training the run, or its files are
            broken or cannot be written.
    """
    if not names:
        return {}
    folders.lock(folder).close()  # refused while another process trains the run
    path = folder.loggers
    run_ids = dict(read_logger_runs(path).run_ids) if path.is_file() else {}
    places: dict[str, str] = {}
    for name in names:
        make = _class_of(name)
        try:
            logger = make(folder.name, folder.config(), run_ids.get(name))
        except Exception as error:
            said = one_line(error).rstrip(".")
            raise ListenerError(f"logger {name!r}: cannot be opened: {said}") from error
        listeners.add(f"logger {name!r}", logger)
        places[name] = logger.where
        run_ids[name] = logger.run_id
        with files.refusing(str(path)):
            files.write_atomic(path, files.to_json(LoggerRuns(run_ids=run_ids)), follow=False)
    return places


def read_logger_runs(path: Path) -> LoggerRuns:
    """Read what `open_loggers` wrote.

    Raises:
        UserError: the file is missing, broken or of another version.
    """
    return records.decode_json(path, LoggerRuns, FORMAT_VERSION)


def _class_of(name: LoggerName) -> Callable[[str, Config, str | None], ServiceLogger]:
    try:
        if name == "wandb":
            from touchdown.training.wandb_logger import WandbLogger  # noqa: PLC0415 - an extra

            return WandbLogger
        from touchdown.training.mlflow_logger import MlflowLogger  # noqa: PLC0415 - an extra
    except ImportError:
        raise installation.missing(f"logger {name!r}", name, name) from None
    return MlflowLogger
