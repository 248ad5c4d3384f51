"""Named configurations, each with its source."""

from dataclasses import replace
from typing import Any

from touchdown.config import synonyms
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TrainingConfig,
)
from touchdown.core.errors import UserError
from touchdown.core.names import hint


def _with(base: Config, **changes: Any) -> Config:
    """A config with some fields changed; a dictionary changes the fields of a section."""
    return replace(
        base,
        **{
            name: replace(getattr(base, name), **value) if isinstance(value, dict) else value
            for name, value in changes.items()
        },
    )


# Values that the paper does not state; docs/deviations.md describes how they were found.
_DQN = Config(
    network=NetworkConfig(hidden_sizes=(100, 100, 100)),
    exploration=ExplorationConfig(schedule="exponential", epsilon_decay=0.975, epsilon_end=0.05),
    learning=LearningConfig(
        backend="auto",
        loss="huber",
        reward_scale=0.01,
        max_grad_norm=10.0,
        learning_rate=2.5e-4,
        learning_rate_end=1e-5,
        learning_rate_duration=180_000,
    ),
    training=TrainingConfig(episodes=600),
)
_TARGET = _with(_DQN, learning={"target_period": 1_000})
_RESAVED: dict[str, Any] = {"resaves": 10, "resave_threshold": 99.0}
_PILOT = _with(
    _DQN,
    replay={"resave_threshold": 99.0},  # still decides which transitions count as rewarded
    learning={"reward_scale": 0.1, "learning_rate": 5e-4, "target_period": 800},
    training={
        "episodes": 5_000,
        "max_env_steps": 180_000,
        "validation_period": 5_000,
        "candidate_checkpoints": 8,
    },
)
# The later variants are shown with 16 environments and an update every fourth environment step,
# which takes a third of `pilot`'s time.
_VECTOR = _with(
    _PILOT,
    learning={"update_period": 4, "learning_rate_duration": 45_000},
    training={"num_envs": 16, "episodes": 1_000_000},
)
_ATOMS: dict[str, Any] = {"atoms": 51, "v_min": -30.0, "v_max": 30.0}
_NO_EPSILON: dict[str, Any] = {"schedule": "constant", "epsilon_start": 0.0}
_RAINBOW_LITE = _with(
    _VECTOR,
    network={"dueling": True, "layer_norm": True},
    learning={"double": True, "n_step": 3},
)
_TABLE = Config(
    env_id="FrozenLake-v1",
    algorithm="tabular",
    exploration=ExplorationConfig(
        schedule="linear", epsilon_start=1.0, epsilon_end=0.1, epsilon_duration=50_000
    ),
    learning=LearningConfig(learning_rate=0.1),
    training=TrainingConfig(
        episodes=1_000_000,
        max_env_steps=200_000,
        validation_period=10_000,
        validation_episodes=100,
        final_validation_episodes=500,
    ),
)
_CLASSIC = _with(
    _VECTOR,
    network={"hidden_sizes": (64, 64)},
    replay={"resave_threshold": 0.0},
    exploration={"schedule": "linear", "epsilon_end": 0.04, "epsilon_duration": 16_000},
    learning={
        "double": True,
        "learning_rate": 1e-3,
        "learning_rate_duration": 50_000,
        "target_period": 400,
        "update_period": 2,
    },
    training={"num_envs": 8, "max_env_steps": 100_000},
)

_PQN = Config(
    algorithm="pqn",
    network=NetworkConfig(hidden_sizes=(128, 128), layer_norm=True),
    exploration=ExplorationConfig(schedule="linear", epsilon_end=0.02, epsilon_duration=60_000),
    learning=LearningConfig(
        backend="auto",
        loss="huber",
        reward_scale=0.1,
        max_grad_norm=10.0,
        learning_rate=1e-3,
        learning_rate_end=1e-5,
        learning_rate_duration=12_000,
    ),
    rollout=RolloutConfig(rollout_steps=16, epochs=4, minibatches=4, trace_decay=0.9),
    training=replace(_VECTOR.training, num_envs=16),
)
_SWIFT = _with(
    _PQN,
    network={"hidden_sizes": (64, 64)},
    learning={
        "backend": "fused",
        "learning_rate_end": 1e-4,
        "learning_rate_duration": 15_000,
    },
    rollout={"rollout_steps": 32, "minibatches": 32},
    training={
        "num_envs": 64,
        "max_env_steps": 600_000,
        "validation_period": 20_000,
        "validation_episodes": 32,
        "final_validation_episodes": 320,
        "stop_when_solved": True,
    },
)

# The squared loss gives a rare crash its full weight; with the Huber loss, 1% of landings crash.
_ACE = _with(
    _SWIFT,
    network={"hidden_sizes": (128, 128)},
    exploration={"epsilon_end": 0.01, "epsilon_duration": 400_000},
    learning={
        "loss": "mse",
        "gamma": 0.997,
        "learning_rate": 3e-4,
        "learning_rate_end": 1e-5,
        "learning_rate_duration": 750_000,
        "averaging": 0.005,
    },
    rollout={"epochs": 3, "minibatches": 32, "mirror_half": True},
    training={
        "max_env_steps": 16_000_000,
        "validation_period": 1_000_000,
        "validation_episodes": 500,
        "final_validation_episodes": 2_000,
        "test_episodes": 1_000,
        "stop_when_solved": False,
    },
)

# Four environments keep one that hovers from filling the memory; docs/speed.md has what was tried.
_FRUGAL = Config(
    network=NetworkConfig(hidden_sizes=(64, 64), layer_norm=True),
    replay=ReplayConfig(min_size=500, mirrored=True),
    exploration=ExplorationConfig(schedule="linear", epsilon_end=0.02, epsilon_duration=4_000),
    learning=LearningConfig(
        backend="fused",
        loss="huber",
        reward_scale=0.1,
        max_grad_norm=10.0,
        learning_rate=3e-4,
        gradient_steps=4,
        polyak=0.005,
        averaging=0.004,
        double=True,
        n_step=3,
    ),
    training=TrainingConfig(
        num_envs=4,
        episodes=1_000_000,
        max_env_steps=200_000,
        validation_period=500,
        validation_episodes=32,
        final_validation_episodes=1_000,
        test_episodes=1_000,
        stop_when_solved=True,
    ),
)

_NAMED: dict[str, tuple[str, Config]] = {
    "dqn": ("section 4, Algorithm 2: replay, no target network", _DQN),
    "target-dqn": ("section 6, Eq. 5: a target network, copied every 1000 env steps", _TARGET),
    "preferential-dqn": (
        "section 7: rewarded transitions are stored again",
        _with(_TARGET, replay=_RESAVED),
    ),
    "paper-best": (
        "section 9: the paper's best printed values",
        _with(_DQN, replay=_RESAVED, learning={"gamma": 0.99, "target_period": 800}),
    ),
    "pilot": (
        "section 9 without re-saves, an update every second of 180,000 env steps; `make land`",
        _with(
            _PILOT,
            learning={"update_period": 2, "learning_rate_duration": 90_000},
        ),
    ),
    "tabular-q": (
        "section 1, Algorithm 1: a table, for FrozenLake-v1 or other envs with few states",
        _TABLE,
    ),
    "tabular-sarsa": (
        "on-policy `tabular-q` (appendix A; Rummery & Niranjan, 1994)",
        _with(_TABLE, learning={"target": "sarsa"}),
    ),
    "tabular-expected-sarsa": (
        "`tabular-sarsa` with the mean over next actions (van Seijen et al., 2009)",
        _with(_TABLE, learning={"target": "expected-sarsa"}),
    ),
    "value-iteration": (
        "section 1, Eq. 1: Q* from the environment's own model (Bellman, 1957)",
        _with(
            _TABLE,
            algorithm="value-iteration",
            exploration={"schedule": "constant", "epsilon_start": 0.1},
            learning={"learning_rate": LearningConfig().learning_rate},
            training={"max_env_steps": 2_000, "validation_period": 500},
        ),
    ),
    "tabular-lander": (
        "section 1 on the lander, its observations binned into 87,500 states",
        _with(
            _TABLE,
            env_id="LunarLander-v3",
            table={
                "bins": (5, 5, 5, 5, 7, 5, 2, 2),
                "bins_low": (-0.5, -0.1, -0.75, -1.0, -0.6, -0.6, 0.0, 0.0),
                "bins_high": (0.5, 1.1, 0.75, 0.25, 0.6, 0.6, 1.0, 1.0),
            },
            training={
                "max_env_steps": 180_000,
                "validation_period": 5_000,
                "validation_episodes": 20,
                "final_validation_episodes": 100,
                "candidate_checkpoints": 8,
            },
        ),
    ),
    "online-q": (
        "section 3, Eq. 4: each transition is used once; no replay, no target network",
        _with(
            _PILOT,
            replay={"capacity": 1, "min_size": 1},
            learning={"batch_size": 1, "target_period": 0, "learning_rate": 1e-4},
        ),
    ),
    "vector-dqn": (
        "section 9 in 16 environments at once, an update every 4 env steps",
        _VECTOR,
    ),
    "deep-sarsa": (
        "on-policy `vector-dqn` (appendix A; Rummery & Niranjan, 1994)",
        _with(_VECTOR, learning={"target": "sarsa"}),
    ),
    "double-dqn": (
        "`vector-dqn` with double Q-learning (van Hasselt et al., 2016)",
        _with(_VECTOR, learning={"double": True}),
    ),
    "dueling-dqn": (
        "`vector-dqn` with a dueling head (Wang et al., 2016)",
        _with(_VECTOR, network={"dueling": True}),
    ),
    "n-step-dqn": (
        "`vector-dqn` with 3-step returns (Sutton, 1988)",
        _with(_VECTOR, learning={"n_step": 3}),
    ),
    "prioritized-dqn": (
        "`vector-dqn` with prioritised replay (Schaul et al., 2016)",
        _with(_VECTOR, replay={"prioritized": True, "beta_duration": 45_000}),
    ),
    "polyak-dqn": (
        "`vector-dqn` with soft updates of the target network (Lillicrap et al., 2016)",
        _with(_VECTOR, learning={"target_period": 0, "polyak": 0.005}),
    ),
    "layer-norm-dqn": (
        "`vector-dqn` with layer normalisation (Ba, Kiros & Hinton, 2016)",
        _with(_VECTOR, network={"layer_norm": True}),
    ),
    "qr-dqn": (
        "`vector-dqn` with 32 quantiles for each action's return (Dabney et al., 2018)",
        _with(_VECTOR, network={"quantiles": 32}),
    ),
    "c51-dqn": (
        "`vector-dqn` with 51 atoms for each action's return (Bellemare et al., 2017)",
        _with(_VECTOR, network=_ATOMS),
    ),
    "noisy-dqn": (
        "`vector-dqn` with noisy weights instead of ε (Fortunato et al., 2018)",
        _with(_VECTOR, network={"noisy": True}, exploration=_NO_EPSILON),
    ),
    "rainbow": (
        "most variants combined, with layer normalisation (after Hessel et al., 2018)",
        _with(
            _RAINBOW_LITE,
            network={**_ATOMS, "noisy": True},
            replay={"prioritized": True, "beta_duration": 45_000},
            exploration=_NO_EPSILON,
        ),
    ),
    "rainbow-lite": (
        "`rainbow` without its slow parts: atoms, noisy weights, priorities (Hessel et al., 2018)",
        _RAINBOW_LITE,
    ),
    "pqn": (
        "λ-returns from many environments, no replay, no target network (Gallici et al., 2025)",
        _PQN,
    ),
    "swift": (
        "`pqn`, fused, 64 environments; stops once verified to land (Gallici et al., 2025)",
        _SWIFT,
    ),
    "frugal": (
        "double DQN, mirrored replay; lands after few env steps (van Hasselt et al., 2016)",
        _FRUGAL,
    ),
    "ace": (
        "`swift`, but wider and trained for minutes, for the best return (Gallici et al., 2025)",
        _ACE,
    ),
    "cartpole": ("CartPole-v1 (section 4)", _with(_CLASSIC, env_id="CartPole-v1")),
    "acrobot": (
        "Acrobot-v1 (section 4)",
        _with(
            _CLASSIC,
            env_id="Acrobot-v1",
            learning={"n_step": 3, "target_period": 1_000, "learning_rate_duration": 25_000},
            training={"max_env_steps": 50_000, "validation_period": 2_500},
        ),
    ),
    "mountain-car": (
        "MountainCar-v0 (section 4)",
        _with(
            _CLASSIC,
            env_id="MountainCar-v0",
            network={"hidden_sizes": (128, 128)},
            replay={"capacity": 50_000},
            exploration={"epsilon_end": 0.05, "epsilon_duration": 50_000},
            learning={
                "learning_rate_duration": 100_000,
                "batch_size": 128,
                # the goal is far from the start: its value must travel
                "n_step": 5,
                "target_period": 1_000,
            },
            training={"num_envs": 16, "max_env_steps": 200_000},
        ),
    ),
}

# training times on two cores of an AMD EPYC; of `pilot` on one of an Intel Xeon at 2.5 GHz
_TIMES = {"swift": "5 s", "pilot": "40 s", "ace": "5 min"}
PRESETS: dict[str, Config] = {
    name: replace(config, preset=name) for name, (_, config) in _NAMED.items()
}
DESCRIPTIONS = {name: text for name, (text, _) in _NAMED.items()}


def preset(name: str) -> Config:
    """The preset with that name.

    Raises:
        UserError: there is none.
    """
    if name.lower() in synonyms.OTHER_ALGORITHMS:
        raise UserError(
            f"preset {name!r}: touchdown trains by Q-learning only, and `touchdown presets` lists "
            "what it has; it also flies policies of Stable-Baselines3 and CleanRL"
        )
    if name not in PRESETS:
        raise UserError(
            f"preset {name!r}: unknown; {hint(name, PRESETS, '`touchdown presets` lists them')}"
        )
    return PRESETS[name]


def summary_of(name: str) -> dict[str, str]:
    """A preset on one line: its name, what it is, how it learns, in which environment.

    Raises:
        UserError: there is no such preset.
    """
    config = preset(name)
    return {
        "preset": name,
        "text": DESCRIPTIONS[name],
        "algorithm": config.algorithm,
        "env_id": config.env_id,
        "time": _TIMES.get(name, ""),
    }
