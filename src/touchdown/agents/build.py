"""The agent that a config describes."""

from touchdown.agents.agent import Agent, Spaces
from touchdown.agents.dqn import DQNAgent
from touchdown.config import Config
from touchdown.seeding import Streams


def make_agent(config: Config, spaces: Spaces, streams: Streams) -> Agent:
    """A fresh agent for a world of these sizes."""
    return DQNAgent(config, spaces, streams)
