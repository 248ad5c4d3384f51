"""A trained policy as one safetensors file, written and read back; nothing is ever unpickled."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from safetensors.numpy import save

from touchdown.agents.agent import Model
from touchdown.agents.dqn import make_network
from touchdown.agents.networks import QNetwork
from touchdown.agents.tabular import QTable, states_of
from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.config.sections import NetworkConfig, TableConfig
from touchdown.core import files, records
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import FloatArray, Spaces, ValuePolicy
from touchdown.envs import environment
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.named import NamedPolicy

WEIGHTS_FORMAT_VERSION = 2
_KINDS = {"network": NetworkConfig, "table": TableConfig}  # of model, by the key of its config


class _Metadata(msgspec.Struct, frozen=True):
    """Texts in the file's header."""

    env_id: str
    preset: str | None = None
    seed: str | None = None
    facts: str = "{}"
    network: str | None = None
    table: str | None = None


def save_weights(
    path: Path,
    model: Model,
    params: FloatArray,
    facts: WeightsFacts,
    config: Config,
) -> None:
    """Write a policy as one safetensors file that needs nothing else to act again.

    Args:
        path: of the file.
        model: what the parameters are of.
        params: flat, [P].
        facts: to keep beside the weights.
        config: of the run that they come from.
    """
    tensors = {name: np.array(value) for name, value in model.layers(params).items()}
    metadata = {
        "format_version": str(WEIGHTS_FORMAT_VERSION),
        "env_id": config.env_id,
        **{name: json.dumps(value) for name, value in model.describe().items()},
        "preset": config.preset,
        "seed": str(config.seed),
        "facts": json.dumps(msgspec.to_builtins(facts)),
    }
    files.write_atomic(path, save(tensors, metadata))


class Weights(NamedTuple):
    """What a file of `save_weights` holds."""

    model: QNetwork | QTable
    params: FloatArray
    """Flat, [P]."""
    env_id: str
    spaces: Spaces
    """Of that environment."""

    @property
    def policy(self) -> ValuePolicy:
        """Acts by them."""
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
    tensors, metadata = _read(path)
    where = f"{path}: not a policy's weights"
    described = {
        name: records.decode(text, dict[str, Any], where)
        for name, text in (("network", metadata.network), ("table", metadata.table))
        if text is not None
    }
    if len(described) != 1:
        raise UserError(f"{where}: must describe either a network or a table")
    ((name, values),) = described.items()
    model = toml.replace_fields(_KINDS[name](), values, where)
    env_id = metadata.env_id
    spaces = environment.spaces_of(env_id)
    try:
        if isinstance(model, TableConfig):
            shape = QTable(states_of(model, spaces), spaces.num_actions, model)
        else:
            _check_sizes(model, tensors)
            shape = make_network(model, spaces)
        params = shape.params_of(tensors)
    except (UserError, ValueError) as error:
        raise UserError(f"{where} for env_id {env_id!r}: {one_line(error)}") from None
    return Weights(shape, params, env_id, spaces)


def _check_sizes(shape: NetworkConfig, tensors: files.Tensors) -> None:
    """Refuse a network that would need more than the file holds before it is made."""
    widest = max((tensor.size for tensor in tensors.values()), default=0)
    sizes = (*shape.hidden_sizes, shape.quantiles, shape.atoms)
    if any(size > max(widest, 1) for size in sizes):
        raise ValueError(f"they are fewer than {shape} has")


def facts_of(path: Path) -> WeightsFacts:
    """The facts that `save_weights` kept beside the weights.

    Raises:
        UserError: the file is broken.
    """
    _, metadata = _read(path)
    return records.decode(metadata.facts, WeightsFacts, f"{path} [facts]")


def final_return_of(path: Path) -> float:
    """The mean return of the weights that a run chose at its end, on fresh validation starts.

    Raises:
        UserError: the file is broken, or its weights were not chosen yet.
    """
    found = facts_of(path).final_validation_return
    if found is None:
        raise UserError(f"{path} [facts]: final_validation_return: missing")
    return found


def origin_of(path: Path) -> tuple[str, int]:
    """The preset and the training seed that a policy's weights come from.

    Raises:
        UserError: the file is broken, or does not say.
    """
    _, metadata = _read(path)
    if metadata.preset is None:
        raise UserError(f"{path}: preset: missing")
    if metadata.seed is None or not metadata.seed.isdecimal():
        raise UserError(f"{path}: seed = {metadata.seed!r}: must be a whole number")
    return metadata.preset, int(metadata.seed)


def _read(path: Path) -> tuple[files.Tensors, _Metadata]:
    tensors, texts = files.read_tensors(path)
    version = texts.get("format_version")
    if version != str(WEIGHTS_FORMAT_VERSION):
        raise UserError(
            f"{path}: format_version = {version!r}: this touchdown reads {WEIGHTS_FORMAT_VERSION}"
        )
    return tensors, records.convert(texts, _Metadata, f"{path}: not a policy's weights")
