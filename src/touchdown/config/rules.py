"""Rules across the sections of a config: which settings conflict, and which would do nothing."""

import dataclasses
from collections.abc import Mapping
from typing import Protocol

from touchdown.config.sections import (
    MOST_FUSED_LAYERS,
    SECTIONS,
    LearningConfig,
    NetworkConfig,
    RolloutConfig,
    TrainingConfig,
)


class Sections(Protocol):
    """The parts of a `Config` that the rules read."""

    @property
    def algorithm(self) -> str: ...  # noqa: D102 - as `Config` says
    @property
    def options(self) -> Mapping[str, object]: ...  # noqa: D102
    @property
    def network(self) -> NetworkConfig: ...  # noqa: D102
    @property
    def learning(self) -> LearningConfig: ...  # noqa: D102
    @property
    def rollout(self) -> RolloutConfig: ...  # noqa: D102
    @property
    def training(self) -> TrainingConfig: ...  # noqa: D102


_STEP_SIZE = {"learning_rate", "learning_rate_end", "learning_rate_duration"}
# the fields that an algorithm reads, by section: None means all; of a missing section, none
_USED: dict[str, dict[str, frozenset[str] | None]] = {
    "dqn": {"network": None, "replay": None, "learning": None},
    "pqn": {
        "network": frozenset({"hidden_sizes", "activation", "dueling", "layer_norm"}),
        "learning": frozenset(
            {
                "gamma",
                "backend",
                "optimizer",
                "loss",
                "reward_scale",
                "max_grad_norm",
                "averaging",
                "bootstrap_on_time_limit",
                *_STEP_SIZE,
            }
        ),
        "rollout": None,
    },
    "tabular": {
        "learning": frozenset({"gamma", "target", "bootstrap_on_time_limit", *_STEP_SIZE}),
        "table": None,
    },
    "value-iteration": {"learning": frozenset({"gamma", "update_period"})},
}
for _sections in _USED.values():
    _sections |= {"exploration": None, "training": None}

_ANY, _DEFAULT = object(), object()
# what the fused kernel supports, by section: any value of a field, or one; a field that is not
# listed here, such as one added later, must have its default
_FUSED: dict[str, dict[str, object]] = {
    "network": {
        **dict.fromkeys(("hidden_sizes", "dueling", "layer_norm", "noisy_sigma"), _ANY),
        **dict.fromkeys(("quantiles", "atoms", "v_min", "v_max", "noisy"), _ANY),
        "activation": "relu",
    },
    "learning": {
        **dict.fromkeys(_STEP_SIZE, _ANY),
        **dict.fromkeys(("gamma", "backend", "batch_size", "loss", "reward_scale"), _ANY),
        **dict.fromkeys(("max_grad_norm", "target", "update_period", "gradient_steps"), _ANY),
        **dict.fromkeys(("target_period", "polyak", "double", "n_step"), _ANY),
        "averaging": _ANY,
        "bootstrap_on_time_limit": _ANY,
        "optimizer": "adam",
    },
}


def check_together(config: Sections) -> None:
    """Refuse settings that do not go together.

    Raises:
        ValueError: two fields exclude each other, or one is set that the algorithm does not use.
    """
    # an agent of the user's may read every setting; first, so that no later rule asks for a
    # setting that the algorithm does not use
    if config.algorithm in _USED:
        _refuse_what_does_nothing(config)
    if config.network.quantiles and config.learning.loss != "huber":
        raise ValueError(
            f"loss = {config.learning.loss!r}: must be huber with quantiles = "
            f"{config.network.quantiles}, which use the quantile Huber loss"
        )
    if config.learning.backend == "fused" and (refusal := why_not_fused(config)):
        raise ValueError(refusal)
    _check_double(config.learning)


def _check_double(learning: LearningConfig) -> None:
    if learning.double and not learning.has_target:
        raise ValueError(
            "double = True: must have a target network to evaluate; "
            "set target_period or polyak above 0"
        )
    if learning.double and learning.target != "q-learning":
        raise ValueError(
            f"double = True: must be False with target = {learning.target!r}, "
            "which does not select a greedy action"
        )


def usable(config: Sections) -> dict[str, set[str]]:
    """The fields of each section that a config's algorithm and backend can use.

    Args:
        config: an agent of the user's may use every field.
    """
    found = {name: {item.name for item in dataclasses.fields(of)} for name, of in SECTIONS.items()}
    if config.algorithm in _USED:
        for name, used in _USED[config.algorithm].items():
            found[name] &= found[name] if used is None else used
        found = {name: of for name, of in found.items() if name in _USED[config.algorithm]}
    if config.learning.backend == "fused":
        for name in found.keys() & _FUSED.keys():
            found[name] &= {field for field, allowed in _FUSED[name].items() if allowed is _ANY}
    return found


def why_not_fused(config: Sections) -> str | None:
    """The setting that the fused kernel does not support, and what it must be; None if none."""
    return why_not_fused_network(config.network) or _not_fused(config.learning, "learning")


def why_not_fused_network(network: NetworkConfig) -> str | None:
    """The setting of a network that the fused kernel does not support; None if none."""
    sizes = network.hidden_sizes
    if len(sizes) > MOST_FUSED_LAYERS:
        return (
            f"hidden_sizes = {sizes}: must have at most {MOST_FUSED_LAYERS} "
            "layers with backend = 'fused'"
        )
    return _not_fused(network, "network")


def _not_fused(given: NetworkConfig | LearningConfig, section: str) -> str | None:
    for item in dataclasses.fields(given):
        value, allowed = getattr(given, item.name), _FUSED[section].get(item.name, _DEFAULT)
        if allowed is _ANY:
            continue
        wanted = item.default if allowed is _DEFAULT else allowed
        if value != wanted:
            return (
                f"{item.name} = {value!r}: must be {wanted!r} with backend = 'fused'; "
                "backend = 'jax' supports it"
            )
    return None


def _refuse_what_does_nothing(config: Sections) -> None:
    used = _USED[config.algorithm]
    if config.options:
        raise ValueError(
            f"options = {dict(config.options)!r}: must be empty with algorithm = "
            f"{config.algorithm!r}; they are for an agent of your own"
        )
    for section, kind in SECTIONS.items():
        of_section = used.get(section, frozenset())
        if of_section is None:
            continue
        given, default = getattr(config, section), kind()
        for item in dataclasses.fields(kind):
            value, left = getattr(given, item.name), getattr(default, item.name)
            if item.name not in of_section and value != left:
                raise ValueError(
                    f"{item.name} = {value!r}: must stay {left!r} with algorithm = "
                    f"{config.algorithm!r}, which does not use it"
                )
    largest = config.learning.learning_rate
    if config.learning.learning_rate_duration:
        largest = max(largest, config.learning.learning_rate_end)
    if config.algorithm == "tabular" and largest > 1:
        raise ValueError(
            f"learning_rate = {largest}: must be at most 1 with algorithm = 'tabular'; "
            "larger steps overshoot the target and diverge"
        )
    steps = config.training.num_envs * config.rollout.rollout_steps
    if config.algorithm == "pqn" and config.rollout.minibatches > steps:
        raise ValueError(
            f"minibatches = {config.rollout.minibatches}: must be at most the number of steps in a "
            f"rollout, num_envs * rollout_steps = {steps}"
        )
    if config.algorithm == "dqn" and config.learning.target == "expected-sarsa":
        raise ValueError(
            "target = 'expected-sarsa': must be q-learning or sarsa with algorithm = 'dqn'"
        )
