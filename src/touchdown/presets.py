"""Named configurations, each with the section of the paper that it stands for."""

from dataclasses import replace

from touchdown.config import Config, LearningConfig, ReplayConfig
from touchdown.errors import UserError

_DQN = Config(preset="dqn")
_TARGET = replace(_DQN, preset="target-dqn", learning=LearningConfig(target_period=1_000))

PRESETS: dict[str, Config] = {
    "dqn": _DQN,
    "target-dqn": _TARGET,
    "preferential-dqn": replace(
        _TARGET, preset="preferential-dqn", replay=ReplayConfig(resaves=10)
    ),
    "paper-best": replace(
        _TARGET,
        preset="paper-best",
        replay=ReplayConfig(resaves=10),
        learning=LearningConfig(target_period=800),
    ),
    "pilot": replace(_TARGET, preset="pilot", learning=LearningConfig(target_period=800)),
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
