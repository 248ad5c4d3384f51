"""A policy with its name and environment."""

from dataclasses import dataclass

from touchdown.core.terminal import printable
from touchdown.core.types import Policy


@dataclass(frozen=True, slots=True)
class NamedPolicy:
    """A policy, its name as it is shown, and the id of its environment.

    `reward_scale` is the factor of the rewards that a network's values estimate.
    """

    name: str
    policy: Policy
    env_id: str
    reward_scale: float = 1.0

    def __post_init__(self) -> None:
        # a file may be named with bytes that are no text
        object.__setattr__(self, "name", printable(self.name))
