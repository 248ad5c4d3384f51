"""Named configurations, each with the section of the paper that it stands for."""

from dataclasses import replace

from touchdown.config import (
    Config,
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    TrainingConfig,
)
from touchdown.errors import UserError

_STEADY = LearningConfig(loss="huber", reward_scale=0.1, max_grad_norm=10.0)
"""Values that the paper leaves unstated; docs/deviations.md has how they were found."""

_DQN = Config(preset="dqn", learning=_STEADY)
_TARGET = replace(_DQN, preset="target-dqn", learning=replace(_STEADY, target_period=1_000))
_RESAVED = ReplayConfig(resaves=10, resave_threshold=50.0)

PRESETS: dict[str, Config] = {
    "dqn": _DQN,
    "target-dqn": _TARGET,
    "preferential-dqn": replace(_TARGET, preset="preferential-dqn", replay=_RESAVED),
    "paper-best": Config(
        preset="paper-best",
        network=NetworkConfig(hidden_sizes=(100, 100, 100)),
        replay=_RESAVED,
        exploration=ExplorationConfig(schedule="exponential", epsilon_decay=0.975),
        learning=replace(_STEADY, gamma=0.99, target_period=800),
    ),
    "pilot": Config(
        preset="pilot",
        exploration=ExplorationConfig(epsilon_end=0.05),
        learning=replace(
            _STEADY,
            gamma=0.995,
            target_period=800,
            learning_rate_end=1e-5,
            learning_rate_duration=180_000,
        ),
        training=TrainingConfig(episodes=5_000, max_observations=180_000),
    ),
}

SECTIONS_OF_THE_PAPER = {
    "dqn": "section 4, Algorithm 2: replay, no target network",
    "target-dqn": "section 6, Eq. 5: a target network, copied every 1000 observations",
    "preferential-dqn": "section 7: rewarded transitions stored again",
    "paper-best": "section 9: the paper's best printed values",
    "pilot": "sections 4-7 with the values that measurement found best; what `make land` trains",
}


def preset(name: str) -> Config:
    """The preset of that name.

    Raises:
        UserError: there is none.
    """
    if name not in PRESETS:
        raise UserError(f"preset {name!r}: unknown; choose one of {', '.join(PRESETS)}")
    return PRESETS[name]
