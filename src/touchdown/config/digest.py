"""A config's digest, which identifies stored runs; a new setting must not change it."""

import dataclasses
import hashlib
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

import tomli_w

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_FORMAT_VERSION = 1  # of the text that is hashed
_ALWAYS: dict[str, tuple[str, ...]] = {
    "": ("preset", "seed", "env_id", "algorithm"),
    "network": (
        *("hidden_sizes", "activation", "dueling", "layer_norm", "quantiles"),
        *("atoms", "v_min", "v_max", "noisy", "noisy_sigma"),
    ),
    "replay": (
        *("capacity", "min_size", "resaves", "resave_threshold"),
        *("prioritized", "alpha", "beta", "beta_duration"),
    ),
    "exploration": (
        *("schedule", "epsilon_start", "epsilon_end", "epsilon_decay", "epsilon_duration"),
    ),
    "learning": (
        *("gamma", "learning_rate", "learning_rate_end", "learning_rate_duration", "optimizer"),
        *("backend", "batch_size", "loss", "reward_scale", "max_grad_norm", "target"),
        *("update_period", "gradient_steps", "target_period", "polyak", "double", "n_step"),
    ),
    "table": ("bins", "bins_low", "bins_high", "initial_value"),
    "rollout": ("rollout_steps", "epochs", "minibatches", "trace_decay"),
    "training": (
        *("num_envs", "episodes", "max_env_steps", "validation_period", "validation_episodes"),
        *("candidate_checkpoints", "final_validation_episodes", "test_episodes"),
        *("stop_when_solved", "checkpoint_seconds", "metrics_period"),
    ),
}
"""The first version's fields by section ("" is the top), in its order; always hashed.

Never add to it. A later field is hashed only if it differs from its default, so that runs keep
their digest when a field is added.
"""
FORMER_NAMES = {
    "training": {"max_env_steps": "max_observations", "candidate_checkpoints": "finalists"}
}
"""Original names of renamed fields, by section."""


def digest_of(config: "DataclassInstance") -> str:
    """12 hex digits of a config; new settings with their defaults do not change them.

    Args:
        config: a frozen dataclass of fields and sections; its `preset` is ignored.
    """
    return _digest(_text(config))


def digest_with_seed(config: "DataclassInstance", seed: int) -> str:
    """The digest of a config with another seed; for many seeds, far faster than `digest_of`.

    Args:
        config: as in `digest_of`; hashable.
        seed: the seed.
    """
    before, after = _around_seed(config)
    return _digest(f"{before}{seed}{after}")


@lru_cache(maxsize=1 << 12)
def _around_seed(config: "DataclassInstance") -> tuple[str, str]:
    """The text that is hashed, before and after the seed."""
    # the first one: it stands above all tables, and no text of the config stands above it
    before, name, after = _text(config).partition("\nseed = ")
    return before + name, after[after.index("\n") :]


def _text(config: "DataclassInstance") -> str:
    values = _hashed(dataclasses.replace(config, preset="custom"), "")
    return tomli_w.dumps({"format_version": _FORMAT_VERSION, **values})


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _hashed(section: Any, name: str) -> dict[str, Any]:
    """The fields of a section that are hashed, including nested sections."""
    always, former = _ALWAYS.get(name, ()), FORMER_NAMES.get(name, {})
    fields = {item.name: item for item in dataclasses.fields(section)}
    values: dict[str, Any] = {former.get(each, each): getattr(section, each) for each in always}
    for each in fields.keys() - set(always):
        value = getattr(section, each)
        if dataclasses.is_dataclass(value):
            nested = _hashed(value, each)
            if nested or each in _ALWAYS:
                values[each] = nested
        elif value != _default_of(fields[each]):
            is_table = isinstance(value, dict)
            values[each] = _table(cast(dict[str, Any], value)) if is_table else value
    return _in_order(values, always, former)


def _table(values: dict[str, Any]) -> dict[str, Any]:
    """A table by name, with 1.0 as 1, which are equal settings."""
    return {
        name: int(value) if isinstance(value, float) and value.is_integer() else value
        for name, value in sorted(values.items())
    }


def _in_order(
    values: dict[str, Any], always: tuple[str, ...], former: dict[str, str]
) -> dict[str, Any]:
    """The first version's fields in its order, then its sections in theirs, then the rest by name.

    The digest must not depend on where a dataclass declares a later field.
    """
    first = [former.get(each, each) for each in always] + list(_ALWAYS)
    known = [each for each in first if each in values]
    return {each: values[each] for each in (*known, *sorted(values.keys() - set(known)))}


def _default_of(item: "dataclasses.Field[Any]") -> Any:
    if item.default_factory is not dataclasses.MISSING:
        return item.default_factory()
    return item.default
