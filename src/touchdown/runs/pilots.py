"""Pilots by name: a trained run, the PID controller, Gymnasium's heuristic, chance."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from safetensors.numpy import save

from touchdown import config as configs
from touchdown import files
from touchdown.agents.agent import Model
from touchdown.agents.dqn import make_network
from touchdown.agents.networks import QNetwork
from touchdown.agents.table import QTable, states_of
from touchdown.config import Config, NetworkConfig, TableConfig
from touchdown.control.pid import PIDConfig, PIDPilot, Rule
from touchdown.errors import UserError, one_line
from touchdown.foreign.onnx_pilot import read_onnx
from touchdown.foreign.sb3 import read_policy
from touchdown.lander import env as lander
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.types import FloatArray, IntArray, Pilot, Spaces, ValuePilot

WEIGHTS_FORMAT_VERSION = 2
SHIPPED = resources.files("touchdown") / "weights"
"""Where the weights of the pilots lie that come with touchdown, `<name>.safetensors`."""
_KINDS = {"network": NetworkConfig, "table": TableConfig}  # of model, by the key of its config


@dataclass(frozen=True, slots=True)
class NamedPilot:
    """A pilot, what to call it, and the world that it is for."""

    name: str
    pilot: Pilot
    env_id: str


class HeuristicPilot:
    """The controller that Gymnasium ships with its lander."""

    def __init__(self) -> None:
        # Box2D comes with it
        from gymnasium.envs.box2d import lunar_lander  # noqa: PLC0415

        self._heuristic: Any = lunar_lander.heuristic
        # it asks the environment only whether its actions are continuous
        self._env = gymnasium.make("LunarLander-v3", disable_env_checker=True).unwrapped

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, 8] to [N]."""
        return np.array([self._heuristic(self._env, o) for o in observations])


class RandomPilot:
    """Actions as by chance, each a hash of what is observed.

    So a start is always flown alike, whoever flies beside: a generator would be shared.

    Args:
        num_actions: to choose from.
    """

    def __init__(self, num_actions: int) -> None:
        self._num_actions = num_actions

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, D] to [N]."""
        digests = (hashlib.blake2b(row.tobytes(), digest_size=8).digest() for row in observations)
        return np.array([int.from_bytes(digest) % self._num_actions for digest in digests])


def shipped_pid(rule: Rule | None = None) -> PIDConfig:
    """The gains that came out of `touchdown tune pid`, for one rule, or for the better of them."""
    name = f"pid_{rule or 'signed'}.toml"
    with resources.as_file(resources.files("touchdown.control") / name) as path:
        return read_pid(path)


def read_pid(path: Path) -> PIDConfig:
    """Gains from a TOML file, such as `touchdown tune pid` writes.

    Raises:
        UserError: it cannot be read, or a field is unknown or refused.
    """
    start = PIDConfig(
        rule="signed", kp_vertical=0, ki_vertical=0, kp_angle=0, kd_angle=0, dead_band=0
    )
    values = configs.read_toml(path)
    gains = configs.replace_fields(start, values, str(path))
    missing = [item.name for item in fields(start) if item.name not in values]
    if missing:
        raise UserError(f"{path}: {', '.join(missing)}: missing; a PID needs every gain")
    return gains


def load(
    name: str, runs_dir: Path = folders.DEFAULT_RUNS, env_id: str = "LunarLander-v3"
) -> NamedPilot:
    """A pilot by its name.

    Args:
        name: `pid`, `heuristic`, `random`, a run in `runs_dir`, a pilot that comes with touchdown,
            or the path of a run, of a `.safetensors` file that a run wrote, of a `.toml` file with
            a PID's gains, of an `.onnx` model, or of a `.zip` that Stable-Baselines3 saved. A run
            in `runs_dir` goes before a pilot of the same name that comes with touchdown.
        runs_dir: where runs are kept.
        env_id: the world for `random`, a `.zip`, and an `.onnx` that names none; the others know
            theirs.

    Raises:
        UserError: there is no such pilot, its files are broken, or it has nothing to fly with yet.
    """
    path = Path(name)
    if name in folders.CONTROLLERS:
        return _controller(name, env_id)
    if path.suffix in folders.PILOT_FILES:
        return _from_file(path, env_id)
    weights = shipped(name, runs_dir)
    if weights is not None:
        with resources.as_file(weights) as path:
            return load_weights(path)
    return load_run(folders.find(name, runs_dir))


def shipped(name: str, runs_dir: Path) -> Traversable | None:
    """The weights of a pilot that comes with touchdown.

    Args:
        name: of the pilot.
        runs_dir: a run of that name goes before it.

    Returns:
        The file; None if a run goes before it, or no such pilot comes with touchdown.
    """
    weights = SHIPPED / f"{name}.safetensors"
    is_its_name = configs.is_plain_name(name) and not (runs_dir / name).is_dir()
    return weights if is_its_name and weights.is_file() else None


def _controller(name: str, env_id: str) -> NamedPilot:
    if name == "random":
        world = lander.make(env_id)
        world.env.close()
        return NamedPilot(name, RandomPilot(world.spaces.num_actions), env_id)
    if name == "heuristic":
        return NamedPilot(name, HeuristicPilot(), lander.LANDER_IDS[0])
    return NamedPilot(name, PIDPilot(shipped_pid()), lander.LANDER_IDS[0])


def _from_file(path: Path, env_id: str) -> NamedPilot:
    match path.suffix:
        case ".toml":
            return NamedPilot(path.stem, PIDPilot(read_pid(path)), lander.LANDER_IDS[0])
        case ".onnx":
            return NamedPilot(path.stem, *read_onnx(path, env_id))
        case ".zip":
            return NamedPilot(path.stem, read_policy(path, env_id), env_id)
        case _:
            return load_weights(path)


def load_run(folder: RunFolder) -> NamedPilot:
    """The best pilot that a run has found so far.

    Raises:
        UserError: it has none yet, or its files are broken.
    """
    pilot = load_weights(best_weights(folder))
    return NamedPilot(folder.name, pilot.pilot, pilot.env_id)


def best_weights(folder: RunFolder) -> Path:
    """The file of the best weights that a run has found so far.

    Raises:
        UserError: it has none yet.
    """
    if not folder.best.is_file():
        raise UserError(
            f"run {folder.name!r}: no weights yet (they come with the first validation); "
            f"train on with: touchdown train --resume {folder.name}"
        )
    return folder.best


def save_weights(
    path: Path,
    model: Model,
    params: FloatArray,
    facts: Mapping[str, Any],
    config: Config,
) -> None:
    """Write a pilot as one safetensors file that needs nothing else to be flown again.

    Args:
        path: of the file.
        model: what the parameters are of.
        params: flat, [P].
        facts: numbers to keep beside the weights, such as the validation return.
        config: of the run that they come from.
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
    """What a file of `save_weights` holds."""

    model: QNetwork | QTable
    params: FloatArray
    """Flat, [P]."""
    env_id: str
    spaces: Spaces
    """Of that world."""

    @property
    def pilot(self) -> ValuePilot:
        """Flies them."""
        return self.model.pilot(self.params)


def load_weights(path: Path) -> NamedPilot:
    """A pilot from a file of `save_weights`.

    Raises:
        UserError: it is cut off, of another version, or no pilot of ours.
    """
    weights = read_weights(path)
    return NamedPilot(path.stem, weights.pilot, weights.env_id)


def read_weights(path: Path) -> Weights:
    """What a file of `save_weights` holds.

    Raises:
        UserError: it is cut off, of another version, or no pilot of ours.
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
        raise UserError(f"{path}: not a pilot's weights: {one_line(error)}") from None
    world = lander.make(env_id)
    world.env.close()
    try:
        if isinstance(model, TableConfig):
            shape = QTable(states_of(model, world.spaces), world.spaces.num_actions, model)
        else:
            _check_sizes(model, tensors)
            shape = make_network(model, world.spaces)
        params = shape.params_of(tensors)
    except (UserError, ValueError) as error:
        raise UserError(
            f"{path}: not a pilot's weights for env_id {env_id!r}: {one_line(error)}"
        ) from None
    return Weights(shape, params, env_id, world.spaces)


def _check_sizes(shape: NetworkConfig, tensors: files.Tensors) -> None:
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
