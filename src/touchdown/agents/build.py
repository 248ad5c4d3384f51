"""The agent that a config describes."""

from touchdown.agents.agent import Agent
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.table import TabularAgent
from touchdown.config import Config
from touchdown.seeding import Streams
from touchdown.types import Spaces


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
