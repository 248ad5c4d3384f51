"""A test kit for your own agents: `check_agent` checks the contract with training."""

from touchdown.testing.chain import Chain
from touchdown.testing.contract import check_agent

__all__ = ["Chain", "check_agent"]
