"""Finds a policy by object, run, name or file."""

from dataclasses import replace
from importlib.resources.abc import Traversable
from pathlib import Path

from touchdown.api.runs import find_run
from touchdown.core import device
from touchdown.core.errors import UserError
from touchdown.core.names import hint
from touchdown.lander import rules
from touchdown.policies import lookup
from touchdown.policies.named import NamedPolicy
from touchdown.policies.names import BASELINES, POLICY_FILES
from touchdown.runs.run import Run

PolicyLike = str | Path | NamedPolicy | Run
"""A run, its name, `pid`, `heuristic`, `random`, a policy that comes with touchdown, or a file:
weights (`.safetensors`), gains (`.toml`), an `.onnx` model, a Stable-Baselines3 `.zip`, or a
`.pth`, `.pt` or `.cleanrl_model` of CleanRL."""


DEFAULT_ENV = "LunarLander-v3"


def find_policy(
    policy: PolicyLike, runs_dir: Path, env_id: str | None, vecnormalize: str | None = None
) -> NamedPolicy:
    """Find a policy. A run takes precedence over a shipped policy of the same name.

    Args:
        policy: see `PolicyLike`.
        runs_dir: folder of the runs.
        env_id: the environment for policies that do not name theirs; None is the lander. A policy
            for the lander may act in any of its variants.
        vecnormalize: statistics for a Stable-Baselines3 `.zip`; see `read_sb3`.

    Raises:
        UserError: there is no such policy, its files are broken, it has no weights yet, or it acts
            in another environment.
    """
    device.use_default()
    found = _found(policy, runs_dir, env_id or DEFAULT_ENV, vecnormalize)
    wanted = rules.LANDER_ID if env_id == rules.EXACT_ID else env_id
    if wanted is not None and rules.is_lander(found.env_id) and rules.is_lander(wanted):
        return replace(found, env_id=wanted)  # the lander, or one of its variants
    if env_id not in (None, found.env_id):
        raise UserError(
            f"env_id = {env_id!r}: policy {found.name!r} acts in {found.env_id}; leave env_id out"
        )
    return found


def _found(
    policy: PolicyLike, runs_dir: Path, env_id: str, vecnormalize: str | None
) -> NamedPolicy:
    if isinstance(policy, NamedPolicy | Run):
        if vecnormalize is not None:
            raise UserError(
                f"vecnormalize = {vecnormalize!r}: policy {policy.name!r} takes none; it is for "
                "archives of Stable-Baselines3"
            )
        return policy if isinstance(policy, NamedPolicy) else policy.policy
    name = str(policy)
    if vecnormalize is not None or lookup.is_known(name) or shipped(name, runs_dir) is not None:
        return lookup.load(name, env_id, vecnormalize)
    if name and ((runs_dir / name).is_dir() or Path(name).is_dir()):
        return find_run(name, runs_dir).policy
    runs = [path.parent.name for path in runs_dir.glob("*/config.toml")]
    known = (*BASELINES, *lookup.shipped_names())
    listed = (
        f"must be a run of {str(runs_dir)!r}, one of {', '.join(known)}, "
        f"or a file ending in {', '.join(POLICY_FILES)}"
    )
    raise UserError(f"policy {name!r}: unknown; {hint(name, (*known, *runs), listed)}")


def shipped(name: str, runs_dir: Path) -> Traversable | None:
    """The weights of a shipped policy; None if a run has that name, or there is no such policy."""
    return None if (runs_dir / name).is_dir() else lookup.shipped(name)
