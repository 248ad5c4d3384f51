"""The ladder: which rung each rung builds on, and what it changes."""

from typing import Any

from touchdown.config.config import Config
from touchdown.config.fields import flat
from touchdown.config.presets import preset

BUILDS_ON = {
    "tabular-q": "value-iteration",
    "tabular-sarsa": "tabular-q",
    "tabular-expected-sarsa": "tabular-sarsa",
    "tabular-lander": "tabular-q",
    "online-q": "tabular-lander",
    "dqn": "online-q",
    "target-dqn": "dqn",
    "preferential-dqn": "target-dqn",
    "paper-best": "preferential-dqn",
    "pilot": "paper-best",
    "vector-dqn": "pilot",
    "deep-sarsa": "vector-dqn",
    "double-dqn": "vector-dqn",
    "polyak-dqn": "vector-dqn",
    "n-step-dqn": "vector-dqn",
    "dueling-dqn": "vector-dqn",
    "layer-norm-dqn": "vector-dqn",
    "prioritized-dqn": "vector-dqn",
    "qr-dqn": "vector-dqn",
    "c51-dqn": "vector-dqn",
    "noisy-dqn": "vector-dqn",
    "rainbow-lite": "vector-dqn",
    "rainbow": "rainbow-lite",
    "pqn": "vector-dqn",
}
"""The rung that each rung but the first builds on and is compared with."""


def changes(rung: str) -> dict[str, Any]:
    """The fields in which a rung differs from the rung that it builds on, with its own values.

    Fields are named without their section, like flags.

    Args:
        rung: name of a preset in `BUILDS_ON`.
    """
    base = _fields(preset(BUILDS_ON[rung]))
    return {name: value for name, value in _fields(preset(rung)).items() if value != base[name]}


def _fields(config: Config) -> dict[str, Any]:
    """All settings by their bare name, without the label `preset`."""
    values = {name.rpartition(".")[2]: value for name, value in flat(config).items()}
    del values["preset"]
    return values
