"""All settings of a run in one frozen value with a digest."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta

from touchdown.config.checks import check, is_plain_name, settle
from touchdown.config.digest import digest_of
from touchdown.config.rules import check_together, usable
from touchdown.config.sections import (
    ALGORITHMS,
    SECTIONS,
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TableConfig,
    TrainingConfig,
)
from touchdown.config.toml import from_values, read_toml, to_dict, to_text
from touchdown.core import plugins


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """Everything that decides what a run does: the same config on one machine repeats the run."""

    preset: str = "custom"
    """Name of the preset that the settings are based on (a label without effect)."""
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0
    """Training seed: determines initial weights, exploration, replay and training starts."""
    env_id: str = "LunarLander-v3"
    """Gymnasium id, `module:Id` or `module:function` of an environment with a flat Box or Discrete
    observation space and a Discrete action space."""
    algorithm: str = "dqn"
    """How to learn: with a network and a replay memory (dqn), a network without one (pqn), a table
    (tabular), the environment's own model (value-iteration), or an agent of your own
    (package.module:Class)."""
    options: dict[str, bool | int | float | str] = field(default_factory=dict[str, Any], hash=False)
    """Settings of an agent of your own, passed to its class by name."""
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
        known = self.algorithm in ALGORITHMS or plugins.is_plugin(self.algorithm)
        check(
            self,
            "algorithm",
            ok=known,
            wanted=f"one of {', '.join(ALGORITHMS)}, or package.module:Class",
        )
        check(self, "preset", ok=preset_ok, wanted="letters, digits, '.', '_' and '-'")
        check_together(self)

    @property
    def own_code(self) -> dict[str, str]:
        """The user's environment and agent, `module:Name` by field; {} if both are built in."""
        names = {"env_id": self.env_id, "algorithm": self.algorithm}
        return {field: name for field, name in names.items() if plugins.is_plugin(name)}

    @property
    def digest(self) -> str:
        """12 hex digits that two configs share only if they are equal, ignoring `preset`.

        A field that is added later and has its default changes no digest.
        """
        return digest_of(self)


def from_toml(path: Path) -> Config:
    """The config in a TOML file; missing fields have their defaults.

    Raises:
        UserError: unreadable file, unknown field, invalid value or another format version.
    """
    return from_values(read_toml(path), Config(), path)


def usable_toml(config: Config) -> str:
    """A config as TOML with only the fields that its algorithm and backend can use."""
    fields = usable(config)
    values: dict[str, Any] = {}
    for name, value in to_dict(config).items():
        used = fields.get(name, ())
        kept = {key: value[key] for key in value if key in used} if name in SECTIONS else value
        if kept != {}:
            values[name] = kept
    return to_text(values)
