"""A policy with its name and environment."""

from dataclasses import dataclass

from touchdown.core.types import Policy


@dataclass(frozen=True, slots=True)
class NamedPolicy:
    """A policy, its name, and the id of its environment."""

    name: str
    policy: Policy
    env_id: str
