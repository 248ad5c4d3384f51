"""A policy with its name and the environment it is for."""

from dataclasses import dataclass

from touchdown.core.types import Policy


@dataclass(frozen=True, slots=True)
class NamedPolicy:
    """A policy, what to call it, and the world that it is for."""

    name: str
    policy: Policy
    env_id: str
