"""The agent of a config: a built-in one by its name, or a user's by its class."""

import inspect
from collections.abc import Callable
from typing import Any, cast

from touchdown.agents.agent import Agent
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners.factory import make_learner
from touchdown.agents.planning import plan_of
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.states import states_of
from touchdown.agents.tabular import TabularAgent
from touchdown.config.config import Config
from touchdown.core import device, plugins
from touchdown.core.errors import UserError, one_line
from touchdown.core.seeding import Streams, streams
from touchdown.core.types import Spaces
from touchdown.replay.mirrored import mirror_of

_MEMBERS = ("act", "observe", "weights", "policy", "state", "restore")


def check_fits(config: Config, spaces: Spaces) -> None:
    """Refuse a config that does not fit an environment, before anything is created.

    Raises:
        UserError: a table's bins do not fit the environment, value iteration has no model, the
            agent needs a mirror symmetry that the environment lacks, or a user's agent
            cannot be made with the config's options.
    """
    if config.algorithm in ("dqn", "pqn"):
        mirror_of(config, spaces)
    elif config.algorithm in ("tabular", "value-iteration"):
        plan_of(config, spaces)
        states_of(config.table, spaces)
    elif plugins.is_plugin(config.algorithm):
        make_agent(config, spaces, streams(config.seed))


def make_agent(config: Config, spaces: Spaces, generators: Streams) -> Agent:
    """A fresh agent for an environment.

    Raises:
        UserError: the config does not fit the environment, its backend was not built, or a user's
            agent cannot be made.
    """
    match config.algorithm:
        case "dqn" | "pqn":
            return _network_agent(config, spaces, generators)
        case "tabular" | "value-iteration":
            return TabularAgent(config, spaces, generators)
        case _:
            return _custom_agent(config, spaces, generators)


def _network_agent(config: Config, spaces: Spaces, generators: Streams) -> Agent:
    made = DQNAgent if config.algorithm == "dqn" else PQNAgent
    return made(config, spaces, generators, make_learner(config, spaces))


def _custom_agent(config: Config, spaces: Spaces, generators: Streams) -> Agent:
    made = _class_of(config)
    device.start()  # it may compute with JAX
    try:
        return made(config, spaces, generators, **config.options)
    except UserError:
        raise
    except ValueError as error:  # the class refuses an option's value
        raise UserError(f"algorithm = {config.algorithm!r}: {one_line(error)}") from error


def _class_of(config: Config) -> Callable[..., Agent]:
    """The class of a user's agent, checked against the protocol and the config's options."""
    where = f"algorithm = {config.algorithm!r}"
    found: Any = plugins.load(config.algorithm, "algorithm")
    missing = [name for name in _MEMBERS if not callable(getattr(found, name, None))]
    if missing or not inspect.isclass(found):
        kind = "a class" if not inspect.isclass(found) else f"an agent with {', '.join(missing)}"
        raise UserError(f"{where}: must be {kind}; see touchdown.agents.agent.Agent")
    signature = inspect.signature(cast(Callable[..., Any], found))
    try:
        signature.bind(config, None, None, **config.options)
    except TypeError as error:
        known = [
            each.name
            for each in signature.parameters.values()
            if each.kind in (each.KEYWORD_ONLY, each.POSITIONAL_OR_KEYWORD)
        ][3:]
        raise UserError(
            f"{where}: options = {dict(config.options)!r}: {one_line(error)}; it accepts "
            f"{', '.join(known) or 'none'}"
        ) from None
    return cast(Callable[..., Agent], found)
