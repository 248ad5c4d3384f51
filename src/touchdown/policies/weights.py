"""Writes and reads a trained policy as one safetensors file; nothing is unpickled."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from touchdown.agents import registry
from touchdown.agents.models import Network, network_to_act
from touchdown.agents.qtable import QTable
from touchdown.agents.states import states_of
from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.config.sections import NetworkConfig, TableConfig
from touchdown.core import files, finite, limits, plugins, records
from touchdown.core.errors import UserError, one_line
from touchdown.core.seeding import streams
from touchdown.core.types import Described, FloatArray, Policy, Spaces, Tensors
from touchdown.envs import environment
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.named import NamedPolicy

WEIGHTS_FORMAT_VERSION = 2
_KINDS = {"network": NetworkConfig, "table": TableConfig}  # of model, by the key of its config


class _Metadata(msgspec.Struct, frozen=True):
    """Metadata in the file's header."""

    env_id: str
    preset: str | None = None
    seed: str | None = None
    reward_scale: str = "1.0"
    facts: str = "{}"
    network: str | None = None
    table: str | None = None
    config: str | None = None
    """TOML of the run's config, where only its agent can make the policy again."""


def save_weights(
    path: Path,
    weights: Tensors,
    policy: Policy,
    facts: WeightsFacts,
    config: Config,
) -> None:
    """Write a policy as one self-contained safetensors file.

    Args:
        path: the file.
        weights: named arrays.
        policy: the greedy policy of these weights. If it has a network or a table, the file
            describes it; otherwise only the agent's code can recreate the policy.
        facts: numbers to store with the weights, such as the validation return.
        config: config of the run that trained them.

    Raises:
        UserError: a number is not finite.
    """
    if said := finite.complaint(weights):
        raise UserError(f"{path}: not written: {said}")
    if isinstance(policy, Described):
        described = {name: json.dumps(value) for name, value in policy.describe().items()}
    else:
        described = {"config": toml.to_toml(config)}
    metadata = {
        "format_version": str(WEIGHTS_FORMAT_VERSION),
        "env_id": config.env_id,
        **described,
        "preset": config.preset,
        "seed": str(config.seed),
        "reward_scale": str(config.learning.reward_scale),
        "facts": json.dumps(msgspec.to_builtins(facts)),
    }
    files.write_atomic(path, files.to_safetensors(weights, metadata), follow=False)


class Weights(NamedTuple):
    """The contents of a file from `save_weights`."""

    policy: Policy
    """Greedy."""
    env_id: str
    spaces: Spaces
    """Of that environment."""
    model: Network | QTable | None = None
    """Of the policy; None of a policy that only its agent's code can make again."""
    params: FloatArray = np.zeros(0)
    """The model's, flat, [P]."""
    reward_scale: float = 1.0
    """Factor of the rewards that the values of the model estimate; 1 if the file does not say."""


def load_weights(path: Path) -> NamedPolicy:
    """A policy from a file that `save_weights` wrote.

    Raises:
        UserError: it is truncated, of another version, or not a touchdown policy.
    """
    weights = read_weights(path)
    return NamedPolicy(path.stem, weights.policy, weights.env_id, weights.reward_scale)


def read_weights(path: Path) -> Weights:
    """The contents of a file from `save_weights`.

    Raises:
        UserError: it is truncated, of another version, not a touchdown policy, it names code that
            the user did not name, or this process was forked after JAX had started.
    """
    tensors, metadata = _read(path)
    where = f"{path}: not a policy's weights"
    if metadata.config is not None:
        return _read_with_agent(tensors, metadata.config, path)
    described = {
        name: records.decode(text, dict[str, Any], where)
        for name, text in (("network", metadata.network), ("table", metadata.table))
        if text is not None
    }
    if len(described) != 1:
        raise UserError(f"{where}: must describe either a network or a table")
    ((name, values),) = described.items()
    config = toml.replace_fields(_KINDS[name](), values, where)
    env_id = metadata.env_id
    spaces = environment.spaces_of(env_id)
    try:
        if isinstance(config, TableConfig):
            model = QTable(states_of(config, spaces), spaces.num_actions, config)
        else:
            _check_sizes(config, tensors)
            model = network_to_act(config, spaces)
        params = model.params_of(tensors)
    except (UserError, ValueError) as error:
        raise UserError(f"{where} for env_id {env_id!r}: {one_line(error)}") from None
    reward_scale = _scale(metadata.reward_scale, where)
    return Weights(model.policy(params), env_id, spaces, model, params, reward_scale)


def _scale(text: str, where: str) -> float:
    try:
        scale = float(text)
    except ValueError:
        scale = 0.0
    if not 0 < scale < float("inf"):
        raise UserError(f"{where}: reward_scale = {text!r}: must be a number above 0")
    return scale


def _read_with_agent(tensors: Tensors, text: str, path: Path) -> Weights:
    """The policy that an agent of the user's makes of its weights."""
    config = toml.from_values(toml.parse(text, path), Config(), path)
    if not plugins.is_plugin(config.algorithm):
        raise UserError(
            f"{path}: algorithm = {config.algorithm!r}: must be an agent of your own where the "
            "file describes neither a network nor a table"
        )
    spaces = environment.spaces_of(config.env_id)
    agent = registry.make_agent(config, spaces, streams(config.seed))
    try:
        policy = agent.policy(tensors)
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(
            f"{path}: not weights of algorithm {config.algorithm!r}: {one_line(error)}"
        ) from None
    return Weights(policy, config.env_id, spaces)


def _check_sizes(config: NetworkConfig, tensors: Tensors) -> None:
    """Refuse a network with more nodes than the file has numbers, before creating it."""
    sizes = (1, *config.hidden_sizes, max(1, config.quantiles, config.atoms))
    given = sum(tensor.size for tensor in tensors.values())
    if sum(first * second for first, second in pairwise(sizes)) > given:
        raise ValueError(f"it has {given} numbers, fewer than the network that it describes")


def facts_of(path: Path) -> WeightsFacts:
    """The facts that `save_weights` stored with the weights.

    Raises:
        UserError: the file is broken.
    """
    _, metadata = _read(path)
    return records.decode(metadata.facts, WeightsFacts, f"{path} [facts]")


def final_return_of(path: Path) -> float:
    """The mean return of a run's selected weights on fresh validation starts.

    Raises:
        UserError: the file is broken, or its weights were not selected yet.
    """
    found = facts_of(path).final_validation_return
    if found is None:
        raise UserError(f"{path} [facts]: final_validation_return: missing")
    return found


def origin_of(path: Path) -> tuple[str, int]:
    """The preset and the training seed that a policy's weights come from.

    Raises:
        UserError: the file is broken, or does not contain them.
    """
    _, metadata = _read(path)
    if metadata.preset is None:
        raise UserError(f"{path}: preset: missing")
    if metadata.seed is None or not metadata.seed.isdecimal():
        raise UserError(f"{path}: seed = {metadata.seed!r}: must be a whole number")
    return metadata.preset, int(metadata.seed)


def _read(path: Path) -> tuple[Tensors, _Metadata]:
    tensors, texts = files.read_tensors(path, most=limits.WEIGHTS_BYTES)
    if len(tensors) > limits.WEIGHTS_TENSORS:
        raise UserError(
            f"{path}: has {len(tensors)} arrays, must be at most {limits.WEIGHTS_TENSORS}"
        )
    for name, text in texts.items():
        if len(text) > limits.WEIGHTS_TEXT_BYTES:
            raise UserError(
                f"{path} [{name[:100]}]: has {len(text)} characters, must be at most "
                f"{limits.WEIGHTS_TEXT_BYTES}"
            )
    if said := finite.complaint(tensors):
        raise UserError(f"{path}: {said}; its training diverged")
    records.check_readable(texts.get("format_version"), [str(WEIGHTS_FORMAT_VERSION)], path)
    return tensors, records.convert(texts, _Metadata, f"{path}: not a policy's weights")
