"""All settings of a run in one frozen value with a digest."""

import dataclasses
import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from touchdown.config.checks import check, is_plain_name, settle
from touchdown.config.rules import check_together
from touchdown.config.sections import (
    Algorithm,
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TableConfig,
    TrainingConfig,
)
from touchdown.config.toml import digest_text, from_values, read_toml


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """Everything that decides what a run does: the same config on one machine repeats the run."""

    preset: str = "custom"
    """Name of the preset that the settings are based on (a label without effect)."""
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0
    """Training seed: determines initial weights, exploration, replay and training starts."""
    env_id: str = "LunarLander-v3"
    """Gymnasium id of an environment with a flat Box or Discrete observation space and a Discrete
    action space."""
    algorithm: Algorithm = "dqn"
    """How to learn: with a network and a replay memory (dqn), a network without one (pqn), a table
    (tabular), or the environment's own model (value-iteration)."""
    network: NetworkConfig = field(default_factory=NetworkConfig)
    replay: ReplayConfig = field(default_factory=ReplayConfig)
    exploration: ExplorationConfig = field(default_factory=ExplorationConfig)
    learning: LearningConfig = field(default_factory=LearningConfig)
    table: TableConfig = field(default_factory=TableConfig)
    rollout: RolloutConfig = field(default_factory=RolloutConfig)
    training: TrainingConfig = field(default_factory=TrainingConfig)

    def __post_init__(self) -> None:
        settle(self)
        preset_ok = is_plain_name(self.preset)
        check(self, "preset", ok=preset_ok, wanted="letters, digits, '.', '_' and '-'")
        check_together(self)

    @property
    def digest(self) -> str:
        """12 hex digits that two configs share only if they are equal, ignoring `preset`."""
        same = dataclasses.replace(self, preset="custom")
        return hashlib.sha256(digest_text(same).encode()).hexdigest()[:12]


def from_toml(path: Path) -> Config:
    """The config in a TOML file; missing fields have their defaults.

    Raises:
        UserError: unreadable file, unknown field, invalid value or another format version.
    """
    return from_values(read_toml(path), Config(), path)
