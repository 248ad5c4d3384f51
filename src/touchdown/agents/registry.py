"""The agent that a config describes."""

from touchdown.agents.agent import Agent
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.tabular import TabularAgent, plan_of, states_of
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.core.types import Spaces


def check_fits(config: Config, spaces: Spaces) -> None:
    """Refuse a config that does not fit a world, before anything is made for it.

    Raises:
        UserError: a table does not know the world's states, or a plan not its model.
    """
    if config.algorithm in ("tabular", "value-iteration"):
        plan_of(config, spaces)
        states_of(config.table, spaces)


def make_agent(config: Config, spaces: Spaces, streams: Streams) -> Agent:
    """A fresh agent for a world.

    Raises:
        UserError: the config does not fit the world.
    """
    match config.algorithm:
        case "dqn":
            return DQNAgent(config, spaces, streams)
        case "pqn":
            return PQNAgent(config, spaces, streams)
        case "tabular" | "value-iteration":
            return TabularAgent(config, spaces, streams)
