"""A policy with its name and the environment it is for."""

from dataclasses import dataclass

from touchdown.core.types import Policy


@dataclass(frozen=True, slots=True)
class NamedPolicy:
    """A policy, its name, and the id of the environment that it is for."""

    name: str
    policy: Policy
    env_id: str
