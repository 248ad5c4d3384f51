"""A trained policy as one safetensors file, written and read; nothing is ever unpickled."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from safetensors.numpy import save

from touchdown.agents.agent import Model
from touchdown.agents.networks import QNetwork, make_network
from touchdown.agents.qtable import QTable
from touchdown.agents.states import states_of
from touchdown.config.config import Config
from touchdown.config.sections import NetworkConfig, TableConfig
from touchdown.core import files
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import FloatArray, Spaces, Tensors, ValuePolicy
from touchdown.envs import environment
from touchdown.policies.named import NamedPolicy

WEIGHTS_FORMAT_VERSION = 2
_KINDS = {"network": NetworkConfig, "table": TableConfig}  # of model, by the key of its config


def save_weights(
    path: Path,
    model: Model,
    params: FloatArray,
    facts: Mapping[str, Any],
    config: Config,
) -> None:
    """Write a policy as one safetensors file, which needs no other file to be used again.

    Args:
        path: of the file.
        model: the network or the table that the parameters belong to.
        params: flat, [P].
        facts: numbers to store with the weights, such as the validation return.
        config: of the run that trained them.
    """
    tensors = {name: np.array(value) for name, value in model.layers(params).items()}
    metadata = {
        "format_version": str(WEIGHTS_FORMAT_VERSION),
        "env_id": config.env_id,
        **{name: json.dumps(value) for name, value in model.describe().items()},
        "preset": config.preset,
        "seed": str(config.seed),
        "facts": json.dumps(facts),
    }
    files.write_atomic(path, save(tensors, metadata))


class Weights(NamedTuple):
    """The contents of a file of `save_weights`."""

    model: QNetwork | QTable
    params: FloatArray
    """Flat, [P]."""
    env_id: str
    spaces: Spaces
    """Of that environment."""

    @property
    def policy(self) -> ValuePolicy:
        """The greedy policy of the model with these parameters."""
        return self.model.policy(self.params)


def load_weights(path: Path) -> NamedPolicy:
    """A policy from a file of `save_weights`.

    Raises:
        UserError: it is cut off, of another version, or no policy of ours.
    """
    weights = read_weights(path)
    return NamedPolicy(path.stem, weights.policy, weights.env_id)


def read_weights(path: Path) -> Weights:
    """What a file of `save_weights` holds.

    Raises:
        UserError: it is cut off, of another version, or no policy of ours.
    """
    tensors, metadata = files.read_tensors(path)
    version = metadata.get("format_version")
    if version != str(WEIGHTS_FORMAT_VERSION):
        raise UserError(
            f"{path}: format_version = {version!r}: this touchdown reads {WEIGHTS_FORMAT_VERSION}"
        )
    try:
        env_id = metadata["env_id"]
        described = {name: json.loads(metadata[name]) for name in _KINDS if name in metadata}
        (model,) = (_KINDS[name](**values) for name, values in described.items())
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: not a policy's weights: {one_line(error)}") from None
    spaces = environment.spaces_of(env_id)
    try:
        if isinstance(model, TableConfig):
            shape = QTable(states_of(model, spaces), spaces.num_actions, model)
        else:
            _check_sizes(model, tensors)
            shape = make_network(model, spaces)
        params = shape.params_of(tensors)
    except (UserError, ValueError) as error:
        raise UserError(
            f"{path}: not a policy's weights for env_id {env_id!r}: {one_line(error)}"
        ) from None
    return Weights(shape, params, env_id, spaces)


def _check_sizes(shape: NetworkConfig, tensors: Tensors) -> None:
    """Refuse a network that would need more than the file holds before it is made."""
    widest = max((tensor.size for tensor in tensors.values()), default=0)
    sizes = (*shape.hidden_sizes, shape.quantiles, shape.atoms)
    if any(size > max(widest, 1) for size in sizes):
        raise ValueError(f"they are fewer than {shape} has")


def facts_of(path: Path) -> dict[str, Any]:
    """The facts that `save_weights` kept beside the weights.

    Raises:
        UserError: the file is broken or holds none.
    """
    _, metadata = files.read_tensors(path)
    return files.parse_json_object(path, metadata.get("facts", "").encode())
