"""The agent that a config describes."""

from touchdown.agents.agent import Agent
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners.factory import make_learner
from touchdown.agents.planning import plan_of
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.states import states_of
from touchdown.agents.tabular import TabularAgent
from touchdown.config.config import Config
from touchdown.core.seeding import Streams
from touchdown.core.types import Spaces


def check_fits(config: Config, spaces: Spaces) -> None:
    """Refuse a config that does not fit an environment, before anything is made for it.

    Raises:
        UserError: a table's bins do not fit the environment, or value iteration has no model.
    """
    if config.algorithm in ("tabular", "value-iteration"):
        plan_of(config, spaces)
        states_of(config.table, spaces)


def make_agent(config: Config, spaces: Spaces, streams: Streams) -> Agent:
    """A fresh agent for an environment.

    Raises:
        UserError: the config does not fit the environment, or its backend was not built.
    """
    match config.algorithm:
        case "dqn":
            return DQNAgent(config, spaces, streams, make_learner(config, spaces))
        case "pqn":
            return PQNAgent(config, spaces, streams, make_learner(config, spaces))
        case "tabular" | "value-iteration":
            return TabularAgent(config, spaces, streams)
