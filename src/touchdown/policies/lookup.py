"""Policies by name: baselines, shipped policies, and files."""

from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from touchdown.config import checks
from touchdown.control.pid import PIDPolicy
from touchdown.core.errors import UserError
from touchdown.core.names import check_misspelt
from touchdown.envs import environment
from touchdown.lander import rules
from touchdown.policies import names
from touchdown.policies.baselines import HeuristicPolicy, RandomPolicy, read_pid, shipped_pid
from touchdown.policies.foreign.onnx import read_onnx
from touchdown.policies.foreign.sb3 import read_sb3
from touchdown.policies.foreign.torch_file import read_torch
from touchdown.policies.named import NamedPolicy
from touchdown.policies.weights import load_weights

SHIPPED = resources.files("touchdown.policies") / "shipped"
"""Folder of the shipped weights, `<name>.safetensors`."""


def load(name: str, env_id: str = "LunarLander-v3", vecnormalize: str | None = None) -> NamedPolicy:
    """A policy by its name, of any kind except a run.

    Args:
        name: `pid`, `heuristic`, `random`, a shipped policy, or the path of a file: `.safetensors`
            as a run writes, `.toml` with PID gains, an `.onnx` model, a `.zip` saved by
            Stable-Baselines3, or a `.pth`, `.pt` or `.cleanrl_model` of CleanRL.
        env_id: the environment for `random` and for a file that does not name one; a variant of the
            lander also for `pid`, `heuristic` and gains. Other policies name theirs.
        vecnormalize: statistics for a `.zip`; see `read_sb3`.

    Raises:
        UserError: there is no such policy, or its file is broken.
    """
    path = Path(name)
    if vecnormalize is not None and path.suffix != ".zip":
        raise UserError(
            f"vecnormalize = {vecnormalize!r}: must be None for {name!r}; only a .zip of "
            "Stable-Baselines3 has such statistics"
        )
    if name in names.BASELINES:
        return _baseline(name, env_id)
    if path.suffix in names.POLICY_FILES:
        return _from_file(path, env_id, vecnormalize)
    if path.suffix in names.OTHER_FILES:
        raise UserError(
            f"policy {name!r}: is {names.OTHER_FILES[path.suffix]}; export the network to ONNX "
            "where it was trained, and use the .onnx file"
        )
    weights = shipped(name)
    if weights is None:
        raise UserError(
            f"policy {name!r}: unknown; must be one of {', '.join(names.BASELINES)}, one that "
            f"comes with touchdown, or a file ending in {', '.join(names.POLICY_FILES)}"
        )
    with resources.as_file(weights) as path:
        return load_weights(path)


def is_known(name: str) -> bool:
    """Whether a name is that of a baseline or a file, and so cannot be a run."""
    suffix = Path(name).suffix
    return name in names.BASELINES or suffix in names.POLICY_FILES or suffix in names.OTHER_FILES


def shipped(name: str) -> Traversable | None:
    """The weights of a shipped policy; None if there is none with that name."""
    weights = SHIPPED / f"{name}.safetensors"
    return weights if checks.is_plain_name(name) and weights.is_file() else None


def shipped_names() -> list[str]:
    """The names of the shipped policies."""
    names = (each.name for each in SHIPPED.iterdir() if each.name.endswith(".safetensors"))
    return sorted(name.removesuffix(".safetensors") for name in names)


def _baseline(name: str, env_id: str) -> NamedPolicy:
    if name == "random":
        return NamedPolicy(name, RandomPolicy(environment.spaces_of(env_id).num_actions), env_id)
    if name == "heuristic":
        return NamedPolicy(name, HeuristicPolicy(), _lander(env_id))
    return NamedPolicy(name, PIDPolicy(shipped_pid()), _lander(env_id))


def _lander(env_id: str) -> str:
    """The environment of a controller of the lander: the given one, if it is a lander."""
    return env_id if rules.is_lander(env_id) else rules.LANDER_ID


def _from_file(path: Path, env_id: str, vecnormalize: str | None) -> NamedPolicy:
    check_misspelt(path)
    match path.suffix:
        case ".toml":
            return NamedPolicy(path.stem, PIDPolicy(read_pid(path)), _lander(env_id))
        case ".onnx":
            return NamedPolicy(path.stem, *read_onnx(path, env_id))
        case ".zip":
            return NamedPolicy(path.stem, read_sb3(path, env_id, vecnormalize), env_id)
        case _ if path.suffix in names.TORCH_FILES:
            return NamedPolicy(path.stem, read_torch(path, env_id), env_id)
        case _:
            return load_weights(path)
