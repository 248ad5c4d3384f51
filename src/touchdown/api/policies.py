"""Finds a policy by object, run, name or file."""

from importlib.resources.abc import Traversable
from pathlib import Path

from touchdown.api.runs import find_run
from touchdown.core import device
from touchdown.policies import lookup
from touchdown.policies.named import NamedPolicy
from touchdown.runs.run import Run

PolicyLike = str | Path | NamedPolicy | Run
"""A run, its name, `pid`, `heuristic`, `random`, a policy that comes with touchdown, or a file:
weights (`.safetensors`), gains (`.toml`), an `.onnx` model, a Stable-Baselines3 `.zip`, or a
`.pth`, `.pt` or `.cleanrl_model` of CleanRL."""


def find_policy(
    policy: PolicyLike, runs_dir: Path, env_id: str, vecnormalize: str | None = None
) -> NamedPolicy:
    """Find a policy. A run takes precedence over a shipped policy of the same name.

    Args:
        policy: see `PolicyLike`.
        runs_dir: folder of the runs.
        env_id: the environment for policies that do not name theirs.
        vecnormalize: statistics for a Stable-Baselines3 `.zip`; see `read_sb3`.

    Raises:
        UserError: there is no such policy, its files are broken, or it has no weights yet.
    """
    device.use_default()
    if isinstance(policy, NamedPolicy):
        return policy
    if isinstance(policy, Run):
        return policy.policy
    name = str(policy)
    if vecnormalize is not None or lookup.is_known(name) or shipped(name, runs_dir) is not None:
        return lookup.load(name, env_id, vecnormalize)
    return find_run(name, runs_dir).policy


def shipped(name: str, runs_dir: Path) -> Traversable | None:
    """The weights of a shipped policy; None if a run has that name, or there is no such policy."""
    return None if (runs_dir / name).is_dir() else lookup.shipped(name)
