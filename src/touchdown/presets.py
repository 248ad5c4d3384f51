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

# Values that the paper leaves unstated; docs/deviations.md has how they were found.
_EXPLORATION = ExplorationConfig(schedule="exponential", epsilon_decay=0.975, epsilon_end=0.05)
_LEARNING = LearningConfig(
    loss="huber",
    reward_scale=0.01,
    max_grad_norm=10.0,
    learning_rate=2.5e-4,
    learning_rate_end=1e-5,
    learning_rate_duration=180_000,
)
_RESAVED = ReplayConfig(resaves=10, resave_threshold=99.0)

_DQN = Config(
    preset="dqn",
    network=NetworkConfig(hidden_sizes=(100, 100, 100)),
    exploration=_EXPLORATION,
    learning=_LEARNING,
    training=TrainingConfig(episodes=600),
)
_TARGET = replace(_DQN, preset="target-dqn", learning=replace(_LEARNING, target_period=1_000))

PRESETS: dict[str, Config] = {
    "dqn": _DQN,
    "target-dqn": _TARGET,
    "preferential-dqn": replace(_TARGET, preset="preferential-dqn", replay=_RESAVED),
    "paper-best": replace(
        _DQN,
        preset="paper-best",
        replay=_RESAVED,
        learning=replace(_LEARNING, gamma=0.99, target_period=800),
    ),
}
PRESETS["pilot"] = replace(
    _DQN,
    preset="pilot",
    replay=replace(_RESAVED, resaves=0),  # the threshold still names what is counted as rewarded
    learning=replace(_LEARNING, reward_scale=0.1, learning_rate=5e-4, target_period=800),
    training=TrainingConfig(
        episodes=5_000, max_observations=180_000, validation_period=5_000, finalists=8
    ),
)

_PILOT = PRESETS["pilot"]
PRESETS.update(
    {
        "double-dqn": replace(
            _PILOT, preset="double-dqn", learning=replace(_PILOT.learning, double=True)
        ),
        "dueling-dqn": replace(
            _PILOT, preset="dueling-dqn", network=replace(_PILOT.network, dueling=True)
        ),
        "qr-dqn": replace(_PILOT, preset="qr-dqn", network=replace(_PILOT.network, quantiles=32)),
        "polyak-dqn": replace(
            _PILOT,
            preset="polyak-dqn",
            learning=replace(_PILOT.learning, target_period=0, polyak=0.005),
        ),
        "layer-norm-dqn": replace(
            _PILOT, preset="layer-norm-dqn", network=replace(_PILOT.network, layer_norm=True)
        ),
        "c51-dqn": replace(
            _PILOT,
            preset="c51-dqn",
            network=replace(_PILOT.network, atoms=51, v_min=-30.0, v_max=30.0),
        ),
        "n-step-dqn": replace(
            _PILOT, preset="n-step-dqn", learning=replace(_PILOT.learning, n_step=3)
        ),
        "prioritized-dqn": replace(
            _PILOT,
            preset="prioritized-dqn",
            replay=replace(_PILOT.replay, prioritized=True, beta_duration=180_000),
        ),
        "noisy-dqn": replace(
            _PILOT,
            preset="noisy-dqn",
            network=replace(_PILOT.network, noisy=True),
            exploration=ExplorationConfig(schedule="constant", epsilon_start=0.0),
        ),
    }
)

SECTIONS_OF_THE_PAPER = {
    "dqn": "section 4, Algorithm 2: replay, no target network",
    "target-dqn": "section 6, Eq. 5: a target network, copied every 1000 observations",
    "preferential-dqn": "section 7: rewarded transitions stored again",
    "paper-best": "section 9: the paper's best printed values",
    "pilot": "section 9 without re-saves, 180,000 observations at a higher rate; `make land`",
    "double-dqn": "`pilot` with double Q-learning (van Hasselt et al., 2016)",
    "dueling-dqn": "`pilot` with a dueling head (Wang et al., 2016)",
    "qr-dqn": "`pilot` with 32 quantiles of each action's return (Dabney et al., 2018)",
    "polyak-dqn": "`pilot` with a target network that follows (Lillicrap et al., 2016)",
    "layer-norm-dqn": "`pilot` with layer normalisation (Ba, Kiros & Hinton, 2016)",
    "c51-dqn": "`pilot` with 51 atoms of each action's return (Bellemare et al., 2017)",
    "n-step-dqn": "`pilot` with returns of 3 steps (Sutton, 1988)",
    "prioritized-dqn": "`pilot` with prioritized replay (Schaul et al., 2016)",
    "noisy-dqn": "`pilot` with noisy weights in place of ε (Fortunato et al., 2018)",
}


def preset(name: str) -> Config:
    """The preset of that name.

    Raises:
        UserError: there is none.
    """
    if name not in PRESETS:
        raise UserError(f"preset {name!r}: unknown; choose one of {', '.join(PRESETS)}")
    return PRESETS[name]


def on_the_lander(name: str) -> bool:
    """Whether the preset is meant for the lander."""
    return PRESETS[name].env_id == "LunarLander-v3"
